"""Which numbers of a link's inertial element are NaN or infinite, by the names of the file."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from dynident.robot.tree import Description
from dynident.robot.xmltree import Element, parse


def broken_numbers(description: Description) -> dict[str, tuple[str, ...]]:
    """Return, by link, the stated inertial numbers that are not finite, as in "inertia ixx = nan".

    A NaN in one number shows in all that depend on it, once they are taken about another point:
    the file itself knows which one it was.
    """
    root = parse(description.text, description.path).root
    found: dict[str, tuple[str, ...]] = {}
    tag = "body" if description.format == "mjcf" else "link"
    for number, link in enumerate(root.iter(tag), start=1):
        names = [name for inertial in link.findall("inertial") for name in _broken(inertial)]
        if names:
            found[link.get("name") or f"body_{number}"] = tuple(names)
    return found


def _broken(inertial: Element) -> Iterator[str]:
    for element in inertial.iter():
        tag = "" if element.tag == "inertial" else f"{element.tag} "
        for key, text in element.attrib.items():
            name = tag.strip() if key == "value" and tag else f"{tag}{key}"
            yield from (f"{name} = {word}" for word in text.split() if _is_broken(word))
        if element.tag != "inertial":
            yield from (
                f"{tag}= {word}" for word in (element.text or "").split() if _is_broken(word)
            )


def _is_broken(word: str) -> bool:
    try:
        return not np.isfinite(float(word))
    except ValueError:
        return False
