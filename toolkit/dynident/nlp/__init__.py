"""Identification posed as nonlinear and conic programs.

`Program` is any nonlinear program: variables, residuals, costs, constraints; Ipopt solves it.
`Problem` states what is to be minimised within which set; `pose_conic` puts it to Clarabel through
Drake, `pose` to Ipopt through CasADi, and `certify` says how far an answer is from the optimum.

CasADi takes a third of a second to load: only who poses a nonlinear program waits for it.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
