"""`python -m dynident.cli` is the command `dynident`."""

from dynident.cli import main

main()
