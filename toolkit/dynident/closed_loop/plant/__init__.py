"""The simulated plant as a Drake diagram, and its stepping from sample to sample."""
