"""Given parameters made physically consistent: a description, an estimate or a list of numbers."""

from dynident.refitting.nearest_robot import refit
from dynident.refitting.refit_result import Refit, TorqueErrors
from dynident.refitting.refit_subject import RefitSubject, aligned, read_subject

__all__ = ["Refit", "RefitSubject", "TorqueErrors", "aligned", "read_subject", "refit"]
