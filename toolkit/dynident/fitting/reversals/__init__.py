"""Where a joint's speed passes through zero: rows that tell nothing of its dry friction.

In: a model and recordings. Out: the recordings, which say what rows of a joint do not count (see
`Recording.stops`): around stops of joints that stand, and around reversals that filters and
sampling put at another moment; with the words for that. And estimates, which say whether their
friction widths suit.
"""
