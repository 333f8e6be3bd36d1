"""Guesses of what recordings are, from the motion and torques of the robot as it is described."""
