"""What every benchmark is made of, how it is run, and the page that is made of the answers."""
