"""The map of steps, drawn: step over contact against the error that one contact makes."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

from liggghts_driver.report.style import BLUE, DASHED, GREY, INK, VERMILION, draw

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from liggghts_driver.studies.stability_map import Point

#: The paper's step over the shortest contact.
PAPER = 0.1
_HEIGHT_IN = 3.6
#: What has no place on a logarithmic axis, and is rounding, is drawn at its lower end.
_LEAST = 1e-7
#: Where steps stand that have no number, as a share of the axis.
_TOP = 0.6


def draw_stability(points: Sequence[Point]) -> bytes:
    """A PNG: at left the damped pairs, at right the elastic ones, both over step / contact."""
    return draw(partial(paint_stability, points), _HEIGHT_IN)


def paint_stability(points: Sequence[Point], figure: Figure) -> None:
    """Two panels with the paper's tenth marked in both."""
    damped, elastic = figure.subplots(1, 2)
    _panel(damped, [p for p in points if p.restitution < 1.0], BLUE)
    damped.set_title("damped: error of the restitution", loc="left", fontsize="medium")
    _panel(elastic, [p for p in points if p.restitution == 1.0], VERMILION)
    elastic.set_title("elastic: energy gained or lost", loc="left", fontsize="medium")
    damped.set_ylabel("of one contact, relative")


def _panel(axes: Axes, points: Sequence[Point], colour: str) -> None:
    ended = [point for point in points if math.isfinite(point.largest)]
    stopped = [point.step_over_contact for point in points if point not in ended]
    ordered = sorted(ended, key=lambda point: point.step_over_contact)
    steps = [point.step_over_contact for point in ordered]
    largest = [max(point.largest, _LEAST) for point in ordered]
    mean = [max(point.mean, _LEAST) for point in ordered]
    axes.set(xscale="log", yscale="log", xlabel="step / contact (Eq. 21)")
    axes.plot(steps, largest, color=colour, marker="o", markersize=4, label="worst")
    axes.plot(steps, mean, color=GREY, marker="s", markersize=3, linewidth=1.0, label="mean")
    if stopped:
        top = axes.get_xaxis_transform()
        heights = [_TOP] * len(stopped)
        axes.plot(stopped, heights, "x", color=INK, transform=top, label="stopped")
    axes.axvline(PAPER, color=INK, linestyle=DASHED, linewidth=1.0)
    axes.annotate(
        "the paper",
        (PAPER, 0.03),
        xycoords=("data", "axes fraction"),
        xytext=(3, 0),
        textcoords="offset points",
        fontsize="small",
    )
    axes.legend(loc="upper left", fontsize="small", handlelength=1.2)
