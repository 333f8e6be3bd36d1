"""Where the shapes of candidates are looked for."""
