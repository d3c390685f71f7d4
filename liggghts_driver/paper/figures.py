"""The figures of the page: what each is called, what it shows, and what it was drawn from."""

from __future__ import annotations

import hashlib
import io
import json
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from PIL import Image

from liggghts_driver.errors import ParseError
from liggghts_driver.outputs import write_bytes, write_text
from liggghts_driver.paper import figure_charts, figure_gradients, figure_volumes
from liggghts_driver.paper.catalogue import MAIN
from liggghts_driver.paper.figure_snapshots import paint_snapshots, views
from liggghts_driver.paper.pooled import at_ten
from liggghts_driver.paper.stored import to_text
from liggghts_driver.report.style import draw
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.scene.layout import layout

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from matplotlib.figure import Figure

    from liggghts_driver.paper.stored import Point, Stored

    Paint = Callable[[Stored, Figure], None]

SNAPSHOTS = "paper-snapshots"
_PALETTE = 128


@dataclass(frozen=True)
class Drawing:
    """A figure that is drawn from the stored results; its name is that of its file."""

    name: str
    paint: Paint
    height_in: float


DRAWINGS = (
    Drawing("paper-volumes", figure_volumes.paint_main, 4.6),
    Drawing("paper-gradients", figure_volumes.paint_gradients, 8.6),
    Drawing("paper-friction", figure_volumes.paint_friction, 4.0),
    Drawing("paper-flow", figure_gradients.paint_flow, 6.0),
    Drawing("paper-velocity", figure_gradients.paint_velocity, 4.2),
    Drawing("paper-readings", figure_charts.paint_readings, 4.4),
    Drawing("paper-what-if", figure_charts.paint_what_if, 5.2),
)


def results_sha256(stored: Stored) -> str:
    """Identity of the stored results that a figure was drawn from."""
    return hashlib.sha256(to_text(stored).encode()).hexdigest()


def first_run(stored: Stored) -> Point | None:
    """The first packing at 10 Pa/m, whose spheres are shown; None until it has a sound answer."""
    points = at_ten(stored, MAIN)
    return next((p for p in points if p.sound is not None and p.replicate == 0), None)


def draw_figures(stored: Stored, runs: Path, images: Path, record: Path) -> list[Path]:
    """Draw every figure; the snapshots only where the run's frames are, else they stay.

    Parameters
    ----------
    stored
        The results.
    runs
        The folder of all runs.
    images
        Where the figures go.
    record
        The file that tells what each was drawn from.

    Returns
    -------
    list[Path]
        The figures that were written.
    """
    source = {"results_sha256": results_sha256(stored)}
    made = {
        drawing.name: (draw(partial(drawing.paint, stored), drawing.height_in), source)
        for drawing in DRAWINGS
    }
    shown = first_run(stored)
    if shown is not None and RunDirectory(runs / shown.run).results.exists():
        made[SNAPSHOTS] = (_snapshots(runs / shown.run), _source_of(shown))
    known = read_record(record)
    for name, (png, origin) in made.items():
        write_bytes(images / f"{name}.png", png)
        known[name] = {"sha256": hashlib.sha256(png).hexdigest(), **origin}
    write_text(record, json.dumps(known, indent=1) + "\n")
    return [images / f"{name}.png" for name in made]


def read_record(record: Path) -> dict[str, Any]:
    """What each figure was drawn from, by name.

    Raises
    ------
    ParseError
        If the file tells nothing of the kind.
    """
    if not record.exists():
        return {}
    try:
        return dict(json.loads(record.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError) as error:
        raise ParseError(f"{record}: no record of figures ({error}); move it away") from None


def _source_of(point: Point) -> dict[str, Any]:
    assert point.answer is not None
    deck = point.answer.provenance["deck_sha256"]
    return {"run": point.run, "deck_sha256": deck}


def _snapshots(folder: Path) -> bytes:
    run = RunDirectory(folder)
    place = layout(run.read_scene())
    png = draw(partial(paint_snapshots, views(run), place.low, place.high), 4.6)
    # Ten thousand outlines make a large file; a palette is all that they need.
    out = io.BytesIO()
    with Image.open(io.BytesIO(png)) as image:
        image.convert("RGB").quantize(_PALETTE).save(out, format="png", optimize=True)
    return out.getvalue()
