"""Loads that recordings carry: what is known of them, and what was identified.

`Load` is what somebody knows, `LoadEntry` how a study file says it, `IdentifiedLoad` what data
tell, with the nearest body that can exist (`nearest_possible`). Drives (`drive_gains`) and
wrench sensors (`wrench_sensor`) weigh them alike.
"""

from dynident.fitting.loads.identified_load import IdentifiedLoad, SolvedParts, identified_load
from dynident.fitting.loads.load import Load, LoadSplit, placement, split, symmetric
from dynident.fitting.loads.load_entry import LoadEntry, PayloadEntry, loads_of

__all__ = [
    "IdentifiedLoad",
    "Load",
    "LoadEntry",
    "LoadSplit",
    "PayloadEntry",
    "SolvedParts",
    "identified_load",
    "loads_of",
    "placement",
    "split",
    "symmetric",
]
