"""All kinds of hostile input by their names."""

from __future__ import annotations

from importlib import import_module

from hostile.case import HostileCase

KINDS = ("robots", "recordings", "studies", "experiments", "estimates", "arguments", "calls")
"""Modules with a table CASES."""


def corpus(kind: str) -> dict[str, HostileCase]:
    """Return the cases of a kind by name."""
    return import_module(f"hostile.{kind}").CASES
