"""Look past the mistakes of single keys, so that contradictions are told in the same message.

A scene with a bad key is no scene, and what its tables are to one another cannot be asked. So a
copy is made in which every bad key is left out or has a harmless value; what contradicts itself
there, and does not speak of a mended key, contradicts itself in the user's file too.
"""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from liggghts_driver.scene.checks import Mistake, scene_mistakes
from liggghts_driver.scene.model import Scene, table_class

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    Location = tuple[int | str, ...]

#: Within the bounds of every number that a scene cannot do without.
_HARMLESS = 0.25


def contradictions_beside(data: Mapping[str, Any], bad: Sequence[Location]) -> list[Mistake]:
    """Contradictions between the tables of a scene in which some keys are bad.

    Parameters
    ----------
    data
        The scene's tables.
    bad
        Where the mistakes of single keys are.
    """
    if not isinstance(data, dict):
        return []
    mended = copy.deepcopy(data)
    for location in bad:
        _leave_out(mended, location)
    scene = _validated(mended) or _validated(_filled(mended, bad))
    if scene is None:
        return []
    names = {str(part) for location in bad for part in location if isinstance(part, str)}
    return [found for found in scene_mistakes(scene) if not names & _words(found.name)]


def _words(name: str) -> set[str]:
    return set(name.replace(",", " ").replace(".", " ").replace("[", " ").split())


def _leave_out(data: Any, location: Location) -> None:
    *tables, last = location
    place = data
    for part in tables:
        try:
            place = place[part]
        except (KeyError, IndexError, TypeError):
            return
    if isinstance(place, dict):
        place.pop(last, None)


def _filled(data: dict[str, Any], bad: Sequence[Location]) -> dict[str, Any]:
    """Give the keys that a table cannot do without a harmless value."""
    for table, *rest in bad:
        inner, field = data.get(str(table)), Scene.model_fields.get(str(table))
        kind = table_class(field.annotation) if field else None
        known = kind is not None and len(rest) == 1 and rest[0] in kind.model_fields
        if known and isinstance(inner, dict):
            inner[str(rest[0])] = _HARMLESS
    return data


def _validated(data: Mapping[str, Any]) -> Scene | None:
    try:
        return Scene.model_validate(data)
    except ValidationError:
        return None
