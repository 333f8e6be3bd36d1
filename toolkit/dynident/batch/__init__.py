"""Dynamics of many samples at once: regressor, torque and its derivatives of a tree of joints.

`newton_euler` writes the equations of motion of a robot as CasADi expressions, once; a `Tape` lists
what is left of them as additions and products, and a `Kernel` replays it, one NumPy call an
instruction and block of samples. Where a C compiler is found and the work pays for it, the same
instructions are compiled (`Evaluation` says which, and why); the results are the same to the bit.

Nothing is loaded before it is used: the command asks only whether its environment is in order.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
