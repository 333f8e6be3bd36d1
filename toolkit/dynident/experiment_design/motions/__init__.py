"""Which motions there are: families of them, each linear in its variables and at rest at its ends.

A kind of trajectory is a class here, and one of `dynident.closed_loop` that follows it.
"""
