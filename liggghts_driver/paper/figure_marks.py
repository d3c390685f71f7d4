"""How markers tell of how many packings a number is."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from liggghts_driver.paper.pooled import Pooled


def face(pooled: Pooled, colour: str) -> str:
    """The colour inside a marker: none for one packing, whose bar is that in time."""
    return "white" if pooled.between is None else colour
