"""Transmissions that give way: springs and dead zones between a motor and its link."""
