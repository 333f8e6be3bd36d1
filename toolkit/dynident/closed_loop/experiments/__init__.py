"""Virtual experiments: a robot as it truly is, measured.

In: an `Experiment`, or its file. Out: recordings, and on disk a study that does not mention what
is hidden.
"""
