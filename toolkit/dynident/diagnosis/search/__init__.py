"""The search for missing effects.

In: evidence (`dynident.evidence`: recordings as replicates, columns, noise) and a model fitted to
it. Out: a `Ranking` of every effect that the model lacks, and the effect to add.

- `scores`: what an effect with one shape, or many, would bring, from second moments: the drop of
  the squared residual, its p value, its price. Here it is decided whether an effect is
  identifiable, and whether its values are possible.
- `ranking`: all effects scored, the best refined and cross-validated; the gates.
- `candidate_shapes` and what they call: the shape parameters, and the values at which columns are
  linearised, at which an effect explains most. `shaped_fit`: the same for effects in the model.
- `shapes.residual_lines`: ripple over the position, between the values of its grid or beyond them.
- `global_search`: every shape there may be, where the grid has missed the true one.
- `payload_recordings`: which recordings carry the payload, where the study does not say.
- `selection`: which effect is added, what cannot be told from it, and what is dropped at the end.
"""
