"""What the gains of drives were found to be, up to which scale, and what loads weigh by them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from dynident.fitting.estimate import DataSource
from dynident.fitting.loads import IdentifiedLoad
from dynident.tables import Shown, Table, finite, number, percent

Finding = Literal["given", "identified", "up to a common scale", "not told apart"]
_FIXED = ("given", "identified")
_MUCH_LEFT = 0.2  # of a joint's current
_WEAK = 0.3  # relative standard deviation of a gain
_Z = 1.959964  # of a 95 % interval


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class DriveGains(Shown):
    """Torque per unit of each joint's drive.

    Attributes
    ----------
    joints : (n,) names.
    unit : of the recorded torques, "A" or "%"; "N m" where nothing had to be found.
    units : (n,) of the gains.
    gains : (n,) N m (or N) per unit.
    given : (n,) bool, which were given.
    groups : joints, by name, whose gains are known relative to one another only.
    covariance : (n + p + l, n + p + l) of the logarithms of the gains, the model's parameters and
        the unknown ones of loads; an open scale has no variance, see `GainCovariance`.
    values : (p,) the model's parameters at these gains.
    residual_std : (n,) in the recorded unit.
    loads : as they were identified; those that are wholly known too.
    joint_errors : (n,) norm of what the model leaves of the current, over that of the current.
    lacking : whether what the model leaves is as slow as the motion, as of `ScatteredErrors`.
    rows, effective_rows : equations, and independent ones that would say as much.
    sources : the recordings.
    """

    joints: tuple[str, ...]
    unit: str
    units: tuple[str, ...]
    gains: np.ndarray
    given: np.ndarray
    groups: tuple[tuple[str, ...], ...]
    covariance: np.ndarray
    values: np.ndarray
    residual_std: np.ndarray
    joint_errors: np.ndarray
    lacking: bool = False
    loads: tuple[IdentifiedLoad, ...] = ()
    rows: int = 0
    effective_rows: float = 0.0
    sources: tuple[DataSource, ...] = ()

    @property
    def relative_sigma(self) -> np.ndarray:
        """Standard deviation of log(gain), (n,); within an open group, of the ratio to its mean."""
        return np.sqrt(np.clip(np.diag(self.covariance)[: len(self.joints)], 0.0, None))

    @property
    def sigma(self) -> np.ndarray:
        """Standard deviation of each gain, (n,); NaN where it is given, or not told apart."""
        sigma = np.abs(self.gains) * self.relative_sigma
        known = [one in ("identified", "up to a common scale") for one in self.findings]
        return np.where(known, sigma, np.nan)

    @property
    def intervals(self) -> np.ndarray:
        """95 % intervals of the gains, (n, 2), NaN where only ratios are known."""
        spread = np.exp(_Z * self.relative_sigma)
        found = np.sort(np.stack([self.gains / spread, self.gains * spread], axis=1), axis=1)
        return np.where([[one == "identified"] for one in self.findings], found, np.nan)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What is known of each gain."""
        group_of = {name: group for group in self.groups for name in group}
        found: list[Finding] = []
        for name, given in zip(self.joints, self.given, strict=True):
            group = group_of.get(name)
            if given:
                found.append("given")
            elif group is None:
                found.append("identified")
            else:
                found.append("up to a common scale" if len(group) > 1 else "not told apart")
        return tuple(found)

    @property
    def is_scaled(self) -> bool:
        """Whether a scale is open."""
        return bool(self.groups)

    @property
    def sentence(self) -> str:
        """In one sentence: what is known in N m, and what up to a scale."""
        if not self.groups:
            return "Gains, torques and inertias are known in N m and kg."
        if self.groups == (self.joints,):
            return (
                "Gains, torques and inertias are known up to the common scale of the drives: "
                "nothing in the recordings fixes it."
            )
        alone = [", ".join(group) for group in self.groups if len(group) == 1]
        parts = [f"of {', '.join(one)} up to a common scale" for one in self.groups if len(one) > 1]
        if alone:
            parts.append(
                f"of {', '.join(alone)} not at all, for no other joint shares its inertias"
            )
        rest = [n for n, one in zip(self.joints, self.findings, strict=True) if one in _FIXED]
        if rest:
            parts.insert(0, f"of {', '.join(rest)} in N m per unit")
        return f"The gains are known {'; '.join(parts)}."

    @property
    def remedy(self) -> str:
        """What would fix an open scale; empty where none is open."""
        if not self.groups:
            return ""
        return (
            "The values shown are those at which the description's torque fits best. A known load "
            "in some recordings, the gain of one joint in [drive_gains], or links that the "
            "description is trusted for (trusted) fix the scale."
        )

    @property
    def doubts(self) -> tuple[str, ...]:
        """Sentences on what the model leaves of the currents; none where it leaves noise."""
        left = zip(self.joints, self.joint_errors, strict=True)
        much = [f"{name} ({percent(x, 0)})" for name, x in left if x > _MUCH_LEFT]
        found = []
        if self.lacking:
            found.append(
                "What is left of the currents is as slow as the motion, unlike most noise: the "
                "model lacks something, or the noise is as slow. sigma holds it, and gains may be "
                "further off. `explain` looks for what is missing."
            )
        spread = zip(self.joints, self.relative_sigma, strict=True)
        weak = [f"{name} ({percent(x, 0)})" for name, x in spread if x > _WEAK]
        if weak:
            found.append(
                f"sigma of the gain at {', '.join(weak)} is so large that it is hardly known, and "
                "neither are torques in N m there: give it in [drive_gains]."
            )
        if much:
            found.append(f"The model leaves much of the current at {', '.join(much)}.")
        return tuple(found)

    def table(self) -> Table:
        """A row for each joint."""
        rows = tuple(
            (
                name,
                number(gain),
                number(sigma, 2),
                _between(interval),
                unit,
                finding,
                f"{number(left, 3)} {self.unit}",
            )
            for name, gain, sigma, interval, unit, finding, left in zip(
                self.joints,
                self.gains,
                self.sigma,
                self.intervals,
                self.units,
                self.findings,
                self.residual_std,
                strict=True,
            )
        )
        notes = [self.sentence, *filter(None, [self.remedy])]
        notes.append(self.conversion)
        if any(len(group) > 1 for group in self.groups):
            notes.append("sigma of such a gain is that of its ratio to the mean of its group.")
        notes += self.doubts
        if np.any(self.gains < 0):
            names = [n for n, gain in zip(self.joints, self.gains, strict=True) if gain < 0]
            what = "the recorded sign is opposite to the joint's"
            notes.append(f"A negative gain ({', '.join(names)}): {what}.")
        columns = ("joint", "gain", "sigma", "95 % interval", "unit", "found", "left (std)")
        return Table("Gains of the drives", columns, rows, tuple(notes))

    @property
    def conversion(self) -> str:
        """What torques in N m are, where these gains made them."""
        return f"What is said in N m of torques is {self.unit} times these gains."

    def tables(self) -> tuple[Table, ...]:
        """The gains, then the loads of which anything was identified."""
        gains = () if self.unit == "N m" else (self.table(),)
        return (*gains, *(load.table() for load in self.loads if not load.load.is_known))

    def to_dict(self) -> dict[str, Any]:
        """Gains and loads as JSON has them."""
        shown = zip(
            self.joints,
            self.gains,
            self.sigma,
            self.units,
            self.findings,
            self.intervals,
            self.residual_std,
            strict=True,
        )
        return {
            "unit": self.unit,
            "joints": [
                {
                    "name": name,
                    "gain": float(gain),
                    "sigma": finite(sigma),
                    "interval": None if np.isnan(interval).any() else interval.tolist(),
                    "unit": unit,
                    "finding": finding,
                    "residual_std": float(left),
                }
                for name, gain, sigma, unit, finding, interval, left in shown
            ],
            "common_scales": [list(group) for group in self.groups],
            "sentence": self.sentence,
            "doubts": list(self.doubts),
            "loads": [load.to_dict() for load in self.loads],
        }

    def recorded(self, joint: dict[str, Any]) -> dict[str, Any]:
        """Return torque and noise of a joint, as JSON has them in N m, in the recorded unit."""
        if self.unit == "N m":
            return joint
        size = abs(float(self.gains[self.joints.index(joint["name"])]))
        torques = {
            key: None if joint[key] is None else joint[key] / size
            for key in ("noise_rms", "torque_rms")
        }
        return {**joint, **torques, "torque_unit": self.unit}

    @property
    def words(self) -> str:
        """For the provenance of a converted recording."""
        said = ", ".join(
            f"{name} {number(gain)} {unit} ({finding}"
            + (f", sigma {percent(sigma / abs(gain))})" if np.isfinite(sigma) else ")")
            for name, gain, sigma, unit, finding in zip(
                self.joints, self.gains, self.sigma, self.units, self.findings, strict=True
            )
        )
        return f"torque from {self.unit} by {said}"


def _between(interval: np.ndarray) -> str:
    """An interval as a table has it; a dash where there is none."""
    if not np.isfinite(interval).all():
        return "-"
    low, high = (number(x) for x in interval)
    return f"{low} to {high}"
