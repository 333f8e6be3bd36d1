"""The draft of a study, from a robot description and files that nobody has described yet.

`draft_study` matches columns to joints, guesses units, gear side and sign, finds the clock, idle
ends and repetitions, proposes what to hold out, and returns a `StudyDraft`: the study's text, with
the reason for each line, and the decisions that were taken.
"""

from dynident.study_draft.decision import Ask, Decision
from dynident.study_draft.draft import DraftedRecording, StudyDraft
from dynident.study_draft.drafting import draft_study

__all__ = ["Ask", "Decision", "DraftedRecording", "StudyDraft", "draft_study"]
