"""Recordings that belong together, with their filter and the noise that is stated of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from dynident.arguments import checked
from dynident.errors import RecordingError
from dynident.recording.filters import Filter
from dynident.recording.position_cutoff import common_filter, with_suited_order
from dynident.recording.recording import Recording
from dynident.recording.usable_rows import usable

NoiseSource = Literal["replicates", "given", "unknown"]
"""Where the noise of recordings is known from: repetition, the study, or nowhere."""


@dataclass(frozen=True, eq=False)
class Noise:
    """Stated noise per raw sample, independent from sample to sample.

    Attributes
    ----------
    position_std : (n,) rad or m.
    torque_std : (n,) N m or N.
    """

    position_std: np.ndarray
    torque_std: np.ndarray


@checked
@dataclass(frozen=True, eq=False)
class Dataset:
    """Recordings of the same joints, and how to filter them.

    Attributes
    ----------
    recordings : in any number; unless the filter keeps the ends, their windows leave out where the
        robot stands still there, and a loop's transient before it repeats, see `usable`.
    filter : where there is none `fit`, `compare`, `diagnose` and the other verbs take
        `common_filter`, which suits the recordings, or where their rates call for different ones
        `default_filter` at the rate of each. One that has no low-pass of the positions, and states
        no order of differences, gets that which suits the recordings, see `with_suited_order`.
    noise : needed for a noise floor where nothing repeats; None where it is unknown.

    Raises
    ------
    RecordingError
        If the recordings differ in their joints.
    """

    recordings: tuple[Recording, ...]
    filter: Filter | None = None
    noise: Noise | None = None

    def __post_init__(self) -> None:
        recordings = tuple(self.recordings)
        if self.filter is None or self.filter.ends == "drop":
            recordings = tuple(usable(one) for one in recordings)
        object.__setattr__(self, "recordings", recordings)
        if self.filter is not None:
            object.__setattr__(self, "filter", with_suited_order(self.filter, recordings))
        for recording in self.recordings[1:]:
            if recording.joints != self.recordings[0].joints:
                ours = ", ".join(self.recordings[0].joints)
                what = f"joints {', '.join(recording.joints)} where the others have {ours}"
                raise RecordingError(what, recording.where, "use `Recording.select`")

    def __repr__(self) -> str:
        seconds = sum(one.duration for one in self.recordings)
        names = ", ".join(one.name or one.where for one in self.recordings) or "none"
        filter = f"; {self.filter!r}" if self.filter else ""
        number = "1 recording" if len(self) == 1 else f"{len(self)} recordings"
        return f"<Dataset of {number}, {seconds:.4g} s: {names}{filter}>"

    def __len__(self) -> int:
        return len(self.recordings)

    @staticmethod
    def of(data: Dataset | Recording, joints: Sequence[str]) -> Dataset:
        """Return data as recordings of these joints, see `of_joints`.

        Raises
        ------
        RecordingError
            As `of_joints`.
        """
        dataset = Dataset((data,)) if isinstance(data, Recording) else data
        return dataset.of_joints(joints)

    def of_joints(self, joints: Sequence[str]) -> Dataset:
        """Return the recordings of these joints, in this order, which is that of a model's torques.

        With the filter that suits them where none is stated.

        Raises
        ------
        RecordingError
            If a recording has not all of them.
        """
        names = self.recordings[0].joints if self.recordings else tuple(joints)
        if names == tuple(joints):
            return self._suited()
        if missing := [joint for joint in joints if joint not in names]:
            raise RecordingError(
                f"no joint '{missing[0]}', which the robot has; joints: {', '.join(names)}",
                self.recordings[0].where,
                "name the recording's joints as the robot's are: recording.replace(joints=...)",
            )
        picked = [names.index(joint) for joint in joints]
        noise = self.noise and Noise(self.noise.position_std[picked], self.noise.torque_std[picked])
        recordings = tuple(one.select(joints) for one in self.recordings)
        return Dataset(recordings, self.filter, noise)._suited()

    def _suited(self) -> Dataset:
        """The same with a filter, unless different ones are called for."""
        if self.filter is not None or not self.recordings:
            return self
        return replace(self, filter=common_filter(self.recordings))

    def __add__(self, other: Dataset) -> Dataset:
        """Recordings of both, with this one's filter and noise."""
        return Dataset(self.recordings + other.recordings, self.filter, self.noise)


def without_ends(dataset: Dataset) -> Dataset:
    """Return the dataset with a filter that drops the ends, where its own keeps them."""
    if dataset.filter is None or dataset.filter.ends == "drop":
        return dataset
    return replace(dataset, filter=replace(dataset.filter, ends="drop"))


def filtered_alike(first: Dataset, *others: Dataset) -> tuple[Dataset, ...]:
    """Return datasets whose raw positions are differentiated as those of the first one are.

    Each has the order that suits its own recordings; whoever compares them needs one.
    """
    order = first.filter and first.filter.suited_order
    return first, *(
        replace(one, filter=replace(one.filter, suited_order=order))
        if order and one.filter and one.filter.suited_order
        else one
        for one in others
    )


def numbered(*datasets: Dataset) -> tuple[Dataset, ...]:
    """Return datasets whose recordings can be told apart by their numbers.

    Recordings of a study are numbered as in its file and come back as they are. Where numbers are
    missing (0) or repeated, all are numbered anew from 1, through all datasets.
    """
    numbers = [one.number for dataset in datasets for one in dataset.recordings]
    if 0 not in numbers and len(set(numbers)) == len(numbers):
        return datasets
    found, last = [], 0
    for dataset in datasets:
        recordings = tuple(
            one.replace(number=last + k) for k, one in enumerate(dataset.recordings, start=1)
        )
        last += len(recordings)
        found.append(Dataset(recordings, dataset.filter, dataset.noise))
    return tuple(found)
