"""The recording to make: motions within a robot's limits that tell the most.

`design` is the verb. `motion_limits` says what a motion may do, `motions` which ones there are,
`columns` what their instants tell, `information` how much that is, `geometry` where the
bodies are and how far they stay apart, `motion_program` which motion tells the most, and
`recording_design` what comes of it.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
