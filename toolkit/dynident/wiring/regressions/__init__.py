"""Regressions of a motion: its rows, the moments of each joint, and the same under any gravity."""
