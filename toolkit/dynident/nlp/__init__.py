"""Identification posed as conic and nonlinear programs.

What comes in is a `Problem`: rows of least squares, data and a prior in units of their noise, and
the set (`dynident.constraints.Within`) in which the standard parameters are to lie. There are two
ways to its solution, and each hands on a `Status`, whatever happens:

- `solve_conic`: `pose_conic` puts it to Clarabel through Drake's MathematicalProgram. It is
  convex, so what is found is the optimum; `polished` adds the digits that the solver leaves.
- `solve_nonlinear`: `pose` puts it to Ipopt through CasADi, over parameters of bodies that are
  consistent whatever their values, from several starts.

What goes out is an answer with a `Certificate`: `lower_bound` is what multipliers prove about any
answer, and `certify` puts it in words.

`Program` is any other nonlinear program: a sum of variables, residuals, costs and constraints, that
prints itself with names and units, can be extended, and is solved from several starts. Below it lie
`scaled` (variables and rows of the size of one, exact second derivatives) and `ipopt`.

CasADi takes a third of a second to load: only who poses a nonlinear program waits for it.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
