"""A blind study: effects are hidden in simulated robots, and `dynident explain` is to find them."""
