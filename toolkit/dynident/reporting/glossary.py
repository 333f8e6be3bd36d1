"""What each effect is, for a reader who has never heard its name."""

from __future__ import annotations

from dynident.effects import Effect

_SHOWS: dict[str, str] = {
    "velocity": "Friction shows here.",
    "position": "Gravity, springs and whatever depends on the position show here.",
    "acceleration": "Inertia shows here.",
    "load": "Load is the torque predicted: a wrong gain of the drive shows here.",
    "time": "Warming up, drifting and single disturbance pulses show here.",
    "cycles per revolution": "What comes back several times in each turn, as teeth and magnets do, "
    "shows here as a narrow peak.",
}


def meaning(effect: Effect) -> str:
    """What an effect is, as a clause in plain words."""
    return effect.meaning or f"it shows as {effect.sign_of}"


def use_of(against: str) -> str:
    """What a residual map against this quantity is looked at for; empty where that is not known."""
    return _SHOWS.get(against, "")
