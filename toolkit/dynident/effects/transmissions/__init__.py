"""Transmissions that give way: springs and gaps between a motor and its link."""
