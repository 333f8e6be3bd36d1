"""Which physical effects a model lacks: the search, its verdict, and what to record next.

In: a model (or an estimate) and recordings, of which some are not fitted but judged by; the
controller of their loop where nothing repeats; the criteria (`dynident.criteria`). Out: a
`Diagnosis`: errors before and after, where the model fails, the effects added with the experiment
that would distinguish each from those that explain the same, every candidate, and the verdict.

The way of data is `compare -> rank -> add -> refit -> judge`; `procedure` is those five steps.

- `extension`: the model, effect after effect, the straight way or another. `search`: ranks effects
  and chooses among them. `nuisances`: what is allowed for. `advice`: which
  experiment would show what this data does not.
- `dependence`: what a residual that no effect explains depends on.
- `verdict`: when a model is said to be complete. `track_record`: how often that was right.
- `assembly`: the search put into words and numbers; `result` and `details` are what comes out.
"""

from dynident.diagnosis.details import Candidate, JointResult, Step
from dynident.diagnosis.procedure import diagnose
from dynident.diagnosis.result import Diagnosis

__all__ = ["Candidate", "Diagnosis", "JointResult", "Step", "diagnose"]
