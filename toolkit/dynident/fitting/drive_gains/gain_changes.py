"""Gains and loads with more effects in the model, beside those that were found without them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dynident.fitting.drive_gains.drive_gains import DriveGains
from dynident.tables import Table, percent


def anew_tables(drives: DriveGains | None, anew: DriveGains | None) -> tuple[Table, ...]:
    """Gains and loads as they are with effects added; nothing where none were.

    Parameters
    ----------
    drives : by which torques were converted: of the model as given, or of one with other effects.
    anew : of the model with the effects.
    """
    if drives is None or anew is None:
        return ()
    title = "{}, with the effects added"
    tables = [replace(one, title=title.format(one.title)) for one in anew.tables()]
    change = np.abs(anew.gains / drives.gains - 1.0)
    if drives.unit == "N m" or np.all(drives.given):
        return tuple(tables)
    most = int(np.argmax(change))
    words = (
        "Torques in N m are those by the gains that the search began with. With the effects added "
        f"that of {drives.joints[most]} changes most, by {percent(float(change[most]), 2)}: with "
        "them in the study (`dynident add`) everything rests on the new gains. A drive gain among "
        "the effects added is in these gains: do not add it."
    )
    notes = [note for note in tables[0].notes if note != anew.conversion]
    first = replace(tables[0], notes=(*notes, words))
    return (first, *tables[1:])
