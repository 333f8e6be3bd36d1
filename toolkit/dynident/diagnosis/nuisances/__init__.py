"""What is no missing physics and is allowed for.

In: evidence and a fitted model. Out: the same with the nuisance taken out, and a sentence or a step
that says so.

- `contacts`: bursts in one repetition only, left out of the evidence and reported as steps.
  `pulse_search` finds them by matched filters in what repetitions do not share, which `changes`
  separates and whitens.
- `friction_width`: dry friction that reverses over another range of speeds than the model's law.
- `sticking`: joints that stand at their stops, whose rows there say nothing.
- `reversal_laws`: other laws of dry friction, which effects at reversals must beat;
  `other_reversals` has them.
- `look_alikes`: what an effect that was added may be instead, where no single rival says so.
- `drifting_noise`: what changes from repetition to repetition, and is measured as noise.
- `quantisation`: the residual that the steps of encoders leave, the same in every repetition.
"""
