"""The search for missing effects: score, confirm, refine, select, prune."""
