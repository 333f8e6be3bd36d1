"""What a residual that no effect explains depends on: whether to look for a law, and in what.

In: what the final model leaves of the torque on data that it was not fitted to (`evidence`). Out:
for each joint the shares of it that a flexible regression predicts on blocks of time that it has
not seen, as it is given more and more inputs, each with its standard error.

- `residual_record`: the residual of one recording with the motion that it belongs to.
- `joint_inputs`: what the regression is given: motion and load, the past, other joints, time.
- `position_errors`: what sensors whose error depends on the position would do to the torque.
- `motion_blocks`: what is held out together: blocks of time, their repetitions, and a gap.
- `block_regression`: kernel regressions, each block predicted from the others.
- `explained_shares`: the regressions one after another, and what each adds.
- `bursts`: a few instants that hold most of it.
- `residual_dependence`: the whole of it, in words, as a table and as JSON.
"""
