"""A study as it was read, and written to while it is still that."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Sequence
from functools import cached_property
from pathlib import Path
from threading import RLock

import numpy as np

from dynident.diagnosis import Diagnosis
from dynident.diagnosis.recorded_units import in_recorded_units
from dynident.effects import Law
from dynident.explorer.effect_choices import EffectChoice, effect_choices
from dynident.explorer.search_thread import SearchThread
from dynident.explorer.switched_fit import Refitter
from dynident.study import Study, add_effects, study_digest

_KEPT = 4  # versions of the study that open tabs may still show


class OpenedStudy:
    """One version of a study: the fits of its model, and its diagnosis.

    Parameters
    ----------
    study : as it was read.
    diagnosis : where there is one already.
    """

    def __init__(self, study: Study, diagnosis: Diagnosis | None = None) -> None:
        self.study, self.digest = study, study.digest
        self.search = SearchThread(study, diagnosis)
        self.given = Refitter(study)

    @property
    def refitter(self) -> Refitter:
        """Fits the model as the diagnosis allows for it; as given until that is done."""
        return self.given if self.search.diagnosis is None else self._as_diagnosed

    @property
    def choices(self) -> tuple[EffectChoice, ...]:
        """What can be switched on; nothing until the diagnosis is done."""
        return () if self.search.diagnosis is None else self._choices

    @property
    def diagnosis(self) -> Diagnosis | None:
        """The answer in the unit of the recordings, for words."""
        found = self.search.diagnosis
        return None if found is None else in_recorded_units(found, self.study.drives)

    def chosen(self, labels: Sequence[str]) -> tuple[EffectChoice, ...]:
        """Return the choices of these labels that can be switched on; others are passed over."""
        wanted = set(labels)
        return tuple(one for one in self.choices if one.label in wanted and not one.refusal)

    @cached_property
    def _as_diagnosed(self) -> Refitter:
        found = self.search.diagnosis
        assert found is not None
        # Over which speed dry friction reverses, the diagnosis has found out.
        model = found.before.model
        same = np.array_equal(model.friction_widths, self.study.model.friction_widths)
        return self.given if same else Refitter(self.study, model)

    @cached_property
    def _choices(self) -> tuple[EffectChoice, ...]:
        assert self.search.diagnosis is not None
        return effect_choices(self.search.diagnosis, self.study)


class StudyVersions:
    """The versions of a study file that have been opened, each with what was made of it.

    Parameters
    ----------
    path : the study file.
    read : reads it, once for each version.
    first : the version that has been read already.
    """

    def __init__(self, path: Path, read: Callable[[], Study], first: OpenedStudy) -> None:
        self.path, self._read, self._lock = path, read, RLock()
        self._opened = OrderedDict({first.digest: first})
        self._written: dict[tuple[str, str, tuple[str, ...]], str] = {}

    def latest(self) -> OpenedStudy:
        """Return the study as the file is now, read anew if it is another one.

        Raises
        ------
        DynidentError
            If it cannot be read.
        """
        with self._lock:
            digest = study_digest(self.path)
            if digest not in self._opened:
                read = OpenedStudy(self._read())
                digest = read.digest  # another one, where the file has changed meanwhile
                self._opened.setdefault(digest, read)
            self._opened.move_to_end(digest)
            while len(self._opened) > _KEPT:
                _, old = self._opened.popitem(last=False)
                old.search.stop()
            return self._opened[digest]

    def of(self, digest: str) -> OpenedStudy | None:
        """Return a version; None where it has been forgotten."""
        return self._opened.get(digest)

    def write(self, choices: Sequence[EffectChoice], digest: str, tab: str) -> str:
        """Write effects into the study, as `dynident add` does; what a tab asks twice, once.

        Parameters
        ----------
        choices : what is added.
        digest : of the file that they are added to.
        tab : the name of the tab that asks.

        Returns
        -------
        The digest of the file after that.

        Raises
        ------
        StudyError
            If the file is another one by now, or cannot be written to; then it stays as it is.
        """
        laws: dict[str, Law] = {law.name: law for one in choices for law in one.laws}
        effects = tuple(one.effect for one in choices)
        asked = tab, digest, tuple(effect.label for effect in effects)
        with self._lock:
            if asked not in self._written:
                self._written[asked] = add_effects(
                    self.path, effects, tuple(laws.values()), digest=digest
                )
            return self._written[asked]

    def stop(self) -> None:
        """End what still runs in the background."""
        for one in self._opened.values():
            one.search.stop()
