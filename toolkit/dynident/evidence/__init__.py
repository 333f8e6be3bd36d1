"""What recordings say of a model: columns, fits, noise, held-out errors and residual maps.

In: a model or an estimate, recordings, and the criteria that judge them. Recordings become `Run`s
in replicates that can be compared (`runs`): the repetitions of a period, copies with more of the
stated noise, or the same motion simulated in its loop (`simulated_motion`).

On the way: frozen `Evidence` (`evidence`) is the model, the runs, and the columns of the model and
of every candidate along them. Who carries the payload, which instants are left out or which
motion is simulated is another evidence, made by `with_runs`. All that was made of one another
share a `ColumnCache`, whose keys say everything that columns depend on: the effect with its
shape, the motion and the payload on it, the model and the values at which it is linearised.
Nothing is invalidated by hand; columns of an older linearisation make room for those of the
latest.

Out: an `EvidenceFit`, the model as it fits, with the noise (`noise_model`), what is left at each
joint (`joint_residual`) and the moments on which the diagnosis scores candidates; its errors on
recordings that it has not seen (`held_out`), where it fails (`maps`), and models side by side
(`Comparison`).
"""

from dynident.evidence.comparison import Comparison, compare, compare_models
from dynident.evidence.maps import ResidualMap

__all__ = ["Comparison", "ResidualMap", "compare", "compare_models"]
