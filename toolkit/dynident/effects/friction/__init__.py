"""Friction in the joints: viscous, dry, and what makes either more than that."""
