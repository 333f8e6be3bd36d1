"""Extending a model by the effects that it lacks, one after the other.

In: a `Stage`, the model as given with the evidence that it is fitted to. Out: the stage with all
effects added that pass the gates, each by the straight way (`extending`), or, where that leaves a
residual beyond the noise, by another (`other_ways`). Reversals at which dry friction may follow
another law are left out on the way (`reversals`).
"""
