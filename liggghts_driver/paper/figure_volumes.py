"""Figs. 4, 5 and 6 remade: volumes of particles past a section against time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D

from liggghts_driver.paper import law
from liggghts_driver.paper.catalogue import FIRST, FRICTIONS, TABLE_READINGS
from liggghts_driver.paper.pooled import answers_of, at_ten, by_gradient, of_reading
from liggghts_driver.paper.printed import MAIN_GRADIENT_PA_M, ROWS, SECTIONS, TABLE_1
from liggghts_driver.paper.stored import NOT_RUN
from liggghts_driver.paper.words import counted
from liggghts_driver.report.style import (
    BLUE,
    DASHED,
    GREEN,
    GREY,
    INK,
    ORANGE,
    PURPLE,
    VERMILION,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from liggghts_driver.paper.stored import Curves, Point, Stored

    FloatArray = NDArray[np.float64]

SECTION_COLOURS = {"entrance": BLUE, "middle": VERMILION}
_FRICTION_COLOURS = (BLUE, GREEN, ORANGE, PURPLE)
#: Volumes are drawn in cubic centimetres.
_CM3_IN_MM3 = 1000.0


def mean_curve(curves: Sequence[Curves], section: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times [s], the mean volume over packings [cm3], and ``(2, n)`` smallest and largest."""
    length = min(len(each.volume_mm3[section]) for each in curves)
    time = np.arange(length, dtype=np.float64) * curves[0].interval_s
    rows = [
        np.interp(
            time,
            np.arange(len(each.volume_mm3[section])) * each.interval_s,
            np.array(each.volume_mm3[section]) / _CM3_IN_MM3,
        )
        for each in curves
    ]
    together = np.array(rows)
    mean: FloatArray = np.mean(together, axis=0)
    return time, mean, np.array([together.min(axis=0), together.max(axis=0)])


def curves_of(points: Sequence[Point]) -> list[Curves]:
    """The curves of the packings that have a sound answer."""
    return [answer.curves for answer in answers_of(points).values()]


def paint_main(stored: Stored, figure: Figure) -> None:
    """Fig. 4, a column for each reading of the outside fluid: volumes, and the piston below."""
    grid = figure.subplots(2, 2, sharex=True, sharey="row", height_ratios=(2.0, 1.0))
    row = ROWS[MAIN_GRADIENT_PA_M]
    for column, reading in enumerate(TABLE_READINGS):
        above, below = grid[0, column], grid[1, column]
        points = at_ten(stored, reading)
        _panel(above, points, MAIN_GRADIENT_PA_M)
        for section in SECTIONS:
            _printed_slope(above, points, section, row.flow_m3_s(section))
        for curves in curves_of(points):
            place = np.array(curves.piston_x_um) / 1000.0
            below.plot(np.arange(len(place)) * curves.interval_s, place, color=INK, linewidth=0.9)
        above.set_title(reading.name, fontsize="medium")
        below.set(xlabel="time [s]", xlim=(0.0, _end()))
    grid[0, 0].set_ylabel("volume of particles [cm³]")
    grid[1, 0].set_ylabel("piston [mm]")
    figure.legend(handles=[*_handles(), _slope_handle()], loc="outside upper left", ncols=2)


def paint_gradients(stored: Stored, figure: Figure) -> None:
    """Fig. 5: a row for each gradient, a column for each reading of the outside fluid."""
    grid = figure.subplots(len(TABLE_1), 2, sharex=True, sharey="row")
    for line, row in enumerate(TABLE_1):
        for column, reading in enumerate(TABLE_READINGS):
            axes = grid[line, column]
            points = by_gradient(stored, reading).get(row.gradient_pa_m, [])
            _panel(axes, points, row.gradient_pa_m)
            for section in SECTIONS:
                _printed_slope(axes, points, section, row.flow_m3_s(section))
        grid[line, 0].set_ylabel(f"{row.gradient_pa_m:g} Pa/m\n[cm³]")
    for column, reading in enumerate(TABLE_READINGS):
        grid[0, column].set_title(reading.name, fontsize="medium")
        grid[-1, column].set(xlabel="time [s]", xlim=(0.0, _end()))
    figure.legend(handles=[*_handles(), _slope_handle()], loc="outside upper left", ncols=2)


def paint_friction(stored: Stored, figure: Figure) -> None:
    """Fig. 6: what passes the entrance, for some coefficients of friction; the same packings."""
    axes = figure.add_subplot()
    readings = (FIRST, *FRICTIONS)
    shared = _shared_seeds([of_reading(stored, reading) for reading in readings])
    for reading, colour in zip(readings, _FRICTION_COLOURS, strict=True):
        points = [p for p in of_reading(stored, reading) if p.seed in shared]
        curves = curves_of(points)
        label = "no friction" if reading is FIRST else reading.title
        if curves:
            _band(axes, curves, "entrance", colour)
        axes.plot([], [], color=colour, label=label if curves else f"{label}: {NOT_RUN}")
    _law(axes, MAIN_GRADIENT_PA_M)
    axes.plot([], [], color=INK, linestyle=DASHED, label="law, no friction")
    axes.set(xlabel="time [s]", ylabel="volume past the entrance [cm³]", xlim=(0.0, _end()))
    axes.set_ylim(bottom=0.0)
    if shared:
        title = f"{counted(len(shared), 'packing')}, the same for each curve"
        axes.set_title(title, fontsize="medium", loc="left")
    figure.legend(loc="outside upper left", ncols=2)


def _shared_seeds(several: Sequence[Sequence[Point]]) -> set[int]:
    """The packings that all have of which any has an answer."""
    seeds = [set(answers_of(points)) for points in several]
    ran = [each for each in seeds if each]
    return set.intersection(*ran) if ran else set()


def _end() -> float:
    return law.example().time.duration


def _panel(axes: Axes, points: Sequence[Point], gradient_pa_m: float) -> None:
    """Both sections over all packings, and the law."""
    curves = curves_of(points)
    for section, colour in SECTION_COLOURS.items():
        if curves:
            _band(axes, curves, section, colour)
    _law(axes, gradient_pa_m)
    if not curves:
        middle: Any = {"ha": "center", "va": "center", "transform": axes.transAxes}
        words = axes.text(0.5, 0.5, NOT_RUN, color=GREY, **middle)
        words.set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 2.0})


def _band(axes: Axes, curves: Sequence[Curves], section: str, colour: str) -> None:
    time, mean, (low, high) = mean_curve(curves, section)
    axes.plot(time, mean, color=colour)
    axes.fill_between(time, low, high, color=colour, alpha=0.2, linewidth=0.0)


def _law(axes: Axes, gradient_pa_m: float) -> None:
    volume = law.law_flow_m3_s(gradient_pa_m) * _end() * 1e6
    axes.plot([0.0, _end()], [0.0, volume], color=INK, linestyle=DASHED, linewidth=1.2)


def _printed_slope(axes: Axes, points: Sequence[Point], section: str, flow_m3_s: float) -> None:
    """The paper's slope, through the middle of the second half of our curve."""
    curves = curves_of(points)
    if not curves:
        return
    time, mean, _ = mean_curve(curves, section)
    half = time >= time[-1] / 2
    anchor = float(time[half].mean()), float(mean[half].mean())
    heights = [anchor[1] + 1e6 * flow_m3_s * (t - anchor[0]) for t in (time[half][0], time[-1])]
    axes.plot([time[half][0], time[-1]], heights, color=GREY, linestyle=":", zorder=3)


def _handles() -> list[Line2D]:
    lines = [Line2D([], [], color=c, label=f"past the {s}") for s, c in SECTION_COLOURS.items()]
    return [*lines, Line2D([], [], color=INK, linestyle=DASHED, label="law, entrance")]


def _slope_handle() -> Line2D:
    return Line2D([], [], color=GREY, linestyle=":", label="slope of the paper's DEM")
