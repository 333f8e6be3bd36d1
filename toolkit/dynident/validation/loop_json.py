"""Simulated loops as JSON has them."""

from __future__ import annotations

from typing import Any

from dynident.tables import finite
from dynident.validation.loop_validation import Unsimulated, Validation


def validation_json(found: Validation) -> dict[str, Any]:
    """What `simulate --json` says; numbers that are not known are null."""
    without, tracking, noise = found.without_model, found.tracking, found.noise
    known = bool(found.runs)
    return {
        "verdict": found.verdict,
        "controller": found.controller,
        "settling_s": finite(found.settling),
        "noise": {
            "source": found.noise_source,
            "error": noise.to_dict() if noise else None,
        },
        "error": found.errors.to_dict() if known else None,
        "without_model": without.to_dict() if known else None,
        "tracking": tracking.to_dict() if known else None,
        "joints": [
            {
                "name": joint,
                "error": found.errors.at(j),
                "without_model": without.at(j),
                "tracking": tracking.at(j),
                "noise": noise.at(j) if noise else None,
                "saturated": float(found.saturated[j]),
            }
            for j, joint in enumerate(found.joints if known else ())
        ],
        "recordings": [
            *(
                {
                    "name": run.name,
                    "status": "simulated",
                    "reason": None,
                    "error": found.error_of(run).to_dict(),
                    "saturated": [float(x) for x in run.saturated],
                }
                for run in found.runs
            ),
            *(
                {
                    "name": one.name,
                    "status": one.status,
                    "reason": one.reason,
                    "error": None,
                    "saturated": None,
                }
                for one in found.skipped
            ),
        ],
        "notes": list(found.notes),
    }


def loop_json(loop: Validation | Unsimulated) -> dict[str, Any]:
    """What `compare --json` says of a simulated loop."""
    if isinstance(loop, Unsimulated):
        return {"verdict": "not_simulated", "reason": loop.reason, "error": None, "joints": None}
    return {
        "verdict": loop.verdict,
        "reason": None,
        "error": loop.errors.to_dict(),
        "joints": [{"name": name, **loop.errors.at(j)} for j, name in enumerate(loop.joints)],
    }
