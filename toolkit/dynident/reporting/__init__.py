"""The report and its pictures: what is drawn of a diagnosis or a validation.

In: a `Diagnosis` or a `Validation`. Out: one HTML file (`html.report`), whose parts are the tables
(`diagnosis_tables`, `intervals`), the words (`glossary`, `joint_states`, `next_steps`) and the
figures (`pictures`, `loop_page`) of the same subject.
"""

from __future__ import annotations

from dynident.reporting.html import report

__all__ = ["report"]
