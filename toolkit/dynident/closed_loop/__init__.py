"""Closed loops, compiled or in Drake, and virtual experiments.

Drake is loaded when it simulates something.

In: a `Mechanism` (a robot with the effects that it truly has), a `Reference` and a `Controller`.
Out: `simulate` gives `Rollout`s; `retrace` runs measured references again; an `Experiment` records
virtual measurements, which `write_experiment` writes with a study. A new kind of controller is an
entry of `controllers.LAWS`. Each name is imported when it is asked for.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
