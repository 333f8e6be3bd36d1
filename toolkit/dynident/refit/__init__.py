"""Given parameters made physically consistent: a description, an estimate or a list of numbers."""

from dynident.refit.result import Refit, TorqueErrors
from dynident.refit.subject import Subject, aligned, read_subject
from dynident.refit.verb import refit

__all__ = ["Refit", "Subject", "TorqueErrors", "aligned", "read_subject", "refit"]
