"""Which of several effects it is: how far a recording tells them apart, and what decides.

`imitations` is what rivals can imitate of an effect's torque, `separation` what is said of it.
"""
