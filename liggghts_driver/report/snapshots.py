"""The engine's snapshots, cut to what they show, with the channel drawn in."""

from __future__ import annotations

import io
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image, ImageChops

from liggghts_driver.errors import ParseError
from liggghts_driver.report.camera import side_view
from liggghts_driver.report.numbers import quantity
from liggghts_driver.report.outline import draw, outline
from liggghts_driver.report.picture import Picture

if TYPE_CHECKING:
    from collections.abc import Collection
    from pathlib import Path

    from liggghts_driver.case import Case
    from liggghts_driver.report.camera import Camera
    from liggghts_driver.results.answer import Answer
    from liggghts_driver.rundir import RunDirectory

#: Largest width of a snapshot on the page, and the room around what is seen [px].
_LARGEST_WIDTH, _ROOM = 720, 10

#: Left, upper, right and lower edge of a part of a picture [px].
Edges = tuple[int, int, int, int]


@dataclass(frozen=True)
class Snapshots:
    """Snapshots in the order of time, each with its time as caption.

    ``note`` says how they are seen; ``legend`` gives what is drawn in to its colour.
    """

    pictures: tuple[Picture, ...]
    note: str
    legend: dict[str, str]


def snapshots(case: Case, answer: Answer, directory: RunDirectory) -> Snapshots:
    """The snapshots of a run, all cut alike; walls and piston drawn in where they are exact.

    Raises
    ------
    ParseError
        If a snapshot cannot be read.
    """
    images = {directory.step_of(path): _read(path) for path in directory.snapshot_files()}
    if not images:
        return Snapshots((), "", {})
    camera = side_view(directory.deck.read_text(encoding="utf-8"), case)
    edges = common_edges(list(images.values()), [] if camera is None else [_domain(case, camera)])
    scale = min(1.0, _LARGEST_WIDTH / (edges[2] - edges[0]))
    pictures: list[Picture] = []
    legend: dict[str, str] = {}
    for step, image in images.items():
        part = _part(image, edges, scale)
        if camera is not None:
            lines = outline(case, answer, step)
            draw(part, camera.cut(edges[0], edges[1], scale), lines)
            legend |= {line.meaning: line.colour for line in lines}
        time_s = float(np.interp(step, answer.series["step"], answer.series["time_s"]))
        pictures.append(_picture(part, step, time_s))
    return Snapshots(tuple(pictures), camera.note if camera is not None else "", legend)


def common_edges(images: Collection[Image.Image], wanted: Collection[Edges]) -> Edges:
    """The part of equally large images outside which all of them show their background.

    Parameters
    ----------
    images
        Each with its background in its upper left corner.
    wanted
        Parts that belong to it whether anything is seen in them or not.
    """
    width, height = next(iter(images)).size
    seen = [box for image in images if (box := _difference(image).getbbox()) is not None]
    parts = [*seen, *wanted] or [(0, 0, width, height)]
    left, top, right, bottom = zip(*parts, strict=True)
    return (
        max(0, min(left) - _ROOM),
        max(0, min(top) - _ROOM),
        min(width, max(right) + _ROOM),
        min(height, max(bottom) + _ROOM),
    )


def _difference(image: Image.Image) -> Image.Image:
    background = Image.new("RGB", image.size, image.getpixel((0, 0)))
    return ImageChops.difference(image, background)


def _domain(case: Case, camera: Camera) -> Edges:
    """The part of the picture in which particles can move."""
    low, high = case.layout.low, case.layout.high
    left, right = camera.column(low[0]), camera.column(high[0])
    top, bottom = camera.row(high[2]), camera.row(low[2])
    return math.floor(left), math.floor(top), math.ceil(right), math.ceil(bottom)


def _part(image: Image.Image, edges: Edges, scale: float) -> Image.Image:
    """A part of a picture, smaller by a factor; this smooths the edges of the spheres."""
    width, height = edges[2] - edges[0], edges[3] - edges[1]
    size = max(1, round(scale * width)), max(1, round(scale * height))
    return image.crop(edges).resize(size, Image.Resampling.LANCZOS)


def _read(path: Path) -> Image.Image:
    try:
        with Image.open(path) as image:
            return image.convert("RGB")
    except (OSError, ValueError, SyntaxError) as error:  # all that Pillow raises
        raise ParseError(f"{path}: cannot be read as a picture ({error})") from None


def _picture(image: Image.Image, step: int, time_s: float) -> Picture:
    out = io.BytesIO()
    image.save(out, format="png")
    time = quantity(time_s, "s")
    alt = f"The spheres after {time}, seen from the side"
    return Picture(f"snapshot-{step:010d}", out.getvalue(), alt, f"t = {time}")
