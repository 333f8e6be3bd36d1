"""Virtual measurements: experiments, their files, and the studies that they write."""
