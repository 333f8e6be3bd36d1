"""`python -m dynident`: the command `dynident`, where its script is not on the path."""

from dynident.cli import main

if __name__ == "__main__":
    main()
