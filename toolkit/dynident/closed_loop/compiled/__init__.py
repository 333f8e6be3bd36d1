"""The closed loop as one C function of a structure, stepped without Python and without Drake.

For mechanisms whose accelerations are formulas. `mechanism_numbers` says which are, and what their
numbers are; `loop_source` writes the function, once for all numbers; `loop_function` compiles it
where that pays, by the rule of `dynident.batch`; `run_task` runs one motion.
"""
