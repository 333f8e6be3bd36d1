"""What to record next.

In: a fitted model, what was recorded, and effects that this data cannot show or distinguish. Out: a
sentence that names the experiment that would, with joints, ranges and speeds.

- `candidate_experiments`: motions that the robot could make, and how much of an effect's torque the
  model (and other effects) would leave in each.
- `experiments`: the best of them in words.
"""
