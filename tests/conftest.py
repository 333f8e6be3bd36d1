"""For all tests: no test of times."""

from hypothesis import settings

# What a first example loads takes seconds, and machines differ: a deadline would test both.
settings.register_profile("without deadlines", deadline=None)
settings.load_profile("without deadlines")
