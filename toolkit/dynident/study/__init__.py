"""A study file read into a model, recordings and settings; and written back with more in it.

`load` reads a study, `load_wrenches` the wrench sensors in it, `add_effects` and `add_recording`
write into it. Paths in a study are relative to its folder; unknown keys are refused by name. Its
keys are classes in `study_file`, with what each means below it, and docs/reference/study.md.
"""

from dynident.study.adding import add_effects, add_recording, study_digest
from dynident.study.loading import Study, load
from dynident.study.wrenches import load_wrenches

__all__ = ["Study", "add_effects", "add_recording", "load", "load_wrenches", "study_digest"]
