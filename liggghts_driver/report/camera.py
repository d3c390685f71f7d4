"""Where a point of the scene is on the engine's snapshots.

The engine projects in parallel: seen along y, a length is the same number of pixels everywhere.
A line drawn over the picture is therefore exact.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from liggghts_driver.deck.particles import simulation_box

if TYPE_CHECKING:
    from liggghts_driver.case import Case

#: The command of a deck that leaves out what is before a plane.
_HALVED = re.compile(r"^dump_modify\s+images\s.*\sthresh y >= \S+", re.MULTILINE)
#: The options of a deck's pictures seen from -y: x to the right, z up.
_SIDE_VIEW = re.compile(
    r"^dump\s+images\s(?!.*\scenter\s).*\ssize (\d+) (\d+) view 90 270 zoom (\S+)", re.MULTILINE
)

_HALF = " Spheres with their centre in the half towards the viewer are left out."


@dataclass(frozen=True)
class Camera:
    """A view along y.

    ``left_m`` and ``top_m`` are x and z of the picture's upper left corner; ``note`` says in words
    what is seen.
    """

    left_m: float
    top_m: float
    pixel_m: float
    note: str

    def column(self, x_m: float) -> float:
        """Pixels from the picture's left edge to the plane at x."""
        return (x_m - self.left_m) / self.pixel_m

    def row(self, z_m: float) -> float:
        """Pixels from the picture's upper edge to the plane at z."""
        return (self.top_m - z_m) / self.pixel_m

    def cut(self, left: float, top: float, scale: float) -> Camera:
        """The view of a part that starts at a pixel, ``scale`` times as large."""
        return Camera(
            self.left_m + left * self.pixel_m,
            self.top_m - top * self.pixel_m,
            self.pixel_m / scale,
            self.note,
        )


def side_view(deck: str, case: Case) -> Camera | None:
    """The camera of a deck's snapshots; None if they are not seen along y.

    At zoom 1 the engine fits twice the longest edge of its box into the picture's height. The
    middle of the box is the pixel ``width // 2`` from the left and ``height // 2`` from below.
    """
    found = _SIDE_VIEW.search(deck)
    if found is None:
        return None
    width, height, zoom = int(found[1]), int(found[2]), float(found[3])
    box = simulation_box(case)
    pixel = 2.0 * max(high - low for low, high in box) / (height * zoom)
    middle_x, _, middle_z = (0.5 * (low + high) for low, high in box)
    return Camera(
        left_m=middle_x - (width // 2 + 0.5) * pixel,
        top_m=middle_z + (height - height // 2 - 0.5) * pixel,
        pixel_m=pixel,
        note="Seen along y." + (_HALF if _HALVED.search(deck) else ""),
    )
