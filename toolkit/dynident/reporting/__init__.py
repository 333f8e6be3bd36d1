"""The report and its pictures: what is drawn of a diagnosis or a validation.

In: a `Diagnosis` or a `Validation`. Out: one HTML file (`html.report`), whose parts are the tables
(`diagnosis_tables`, `intervals`), the words (`glossary`, `joint_states`, `next_steps`) and the
figures (`pictures`, `loop_page`) of the same subject.
What draws is loaded when it is asked for: the words of an answer need no figures.
"""

from __future__ import annotations

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
