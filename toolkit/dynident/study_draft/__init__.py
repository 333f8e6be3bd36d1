"""The draft of a study, from a robot description and files that nobody has described yet.

`draft_study` matches columns to joints, guesses units, gear side and sign, finds the clock, idle
ends and repetitions, proposes what to hold out, and returns a `StudyDraft`: the study's text, with
the reason for each line, and the decisions that were taken. `LogFacts` is what somebody knows of
the files.
"""

from dynident.study_draft.decision import Ask, Decision
from dynident.study_draft.draft import DraftedRecording, StudyDraft
from dynident.study_draft.drafting import draft_study
from dynident.study_draft.log_facts import CarriedLoad, LogFacts

__all__ = [
    "Ask",
    "CarriedLoad",
    "Decision",
    "DraftedRecording",
    "LogFacts",
    "StudyDraft",
    "draft_study",
]
