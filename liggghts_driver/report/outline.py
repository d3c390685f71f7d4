"""What the engine does not draw on its snapshots: walls, the specimen's faces, the piston."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from PIL import ImageDraw

from liggghts_driver.report.style import GREY, INK, PALE, VERMILION

if TYPE_CHECKING:
    from collections.abc import Sequence

    from PIL import Image

    from liggghts_driver.case import Case
    from liggghts_driver.report.camera import Camera
    from liggghts_driver.results.answer import Answer

_THIN, _THICK = 0.004, 0.012


@dataclass(frozen=True)
class Line:
    """A straight line seen along y: what it is, x and z of its ends [m].

    ``width`` is that of the line over the picture's.
    """

    meaning: str
    colour: str
    width: float
    start_m: tuple[float, float]
    end_m: tuple[float, float]


def outline(case: Case, answer: Answer, step: int) -> list[Line]:
    """The domain's faces that are seen edge-on, the specimen's faces, the piston at a step."""
    low, high = case.layout.low, case.layout.high
    corners = {
        "z-": ((low[0], low[2]), (high[0], low[2])),
        "z+": ((low[0], high[2]), (high[0], high[2])),
        "x-": ((low[0], low[2]), (low[0], high[2])),
        "x+": ((high[0], low[2]), (high[0], high[2])),
    }
    lines = []
    for face, ends in corners.items():
        if face in case.layout.walls:
            lines.append(Line("walls", GREY, _THIN, *ends))
        elif case.scene.piston is None:
            lines.append(Line("open faces", PALE, _THIN, *ends))
    if case.scene.specimen is not None:
        faces = (0.0, case.scene.specimen.length)
        name = "faces of the specimen"
        lines += [Line(name, INK, _THIN, (x, low[2]), (x, high[2])) for x in faces]
    if case.scene.piston is not None:
        x = float(np.interp(step, answer.series["step"], answer.series["piston_x_m"]))
        if math.isfinite(x):  # a run that failed numerically is reported too
            lines.append(Line("piston", VERMILION, _THICK, (x, low[2]), (x, high[2])))
    return lines


def draw(image: Image.Image, camera: Camera, lines: Sequence[Line]) -> None:
    """Draw lines on the picture of a camera."""
    canvas = ImageDraw.Draw(image)
    for line in lines:
        ends = [(camera.column(x), camera.row(z)) for x, z in (line.start_m, line.end_m)]
        canvas.line(ends, fill=line.colour, width=max(1, round(line.width * image.width)))
