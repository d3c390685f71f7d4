"""The figure of the study of exact problems: error against cost, a panel for each problem."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.report.numbers import fixed, number
from liggghts_driver.report.style import (
    BLUE,
    DASHED,
    GREEN,
    GREY,
    PURPLE,
    VERMILION,
    draw,
    log_ticks,
    tick_at,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from liggghts_driver.studies.exact import Measured

_COLUMNS = 2
_ROW_IN, _HEAD_IN = 2.75, 0.35
#: Colour and marker of each line of a panel, told apart without colour too.
_MARKS = ((BLUE, "o"), (VERMILION, "s"), (GREEN, "^"), (PURPLE, "D"))
#: Room at the right of the last points for the fitted orders, as a share of the axis.
_ROOM = 0.25
#: Heights of two labels are at least this share of the axis apart.
_APART = 0.09
_MOST_TICKS = 5
#: Height of a line of a legend, in points.
_LINE_PT = 12.5
_HOW = "legends: expected orders; beside the lines: fitted; dashed: as expected"


def draw_exact(measured: Sequence[Measured]) -> bytes:
    """A PNG: error over cost on logarithmic axes.

    Beside the finest point of each line stands its fitted order in the knob. The dashed line goes
    from there as the expected order says, which the legend names.
    """
    panels = panels_of([each for each in measured if _points(each)])
    rows = max(1, math.ceil(len(panels) / _COLUMNS))
    return draw(partial(paint_exact, panels), _ROW_IN * rows + _HEAD_IN)


def panels_of(measured: Sequence[Measured]) -> list[tuple[str, list[Measured]]]:
    """Title and lines of each panel: a problem, or one quantity of it where there are too many."""
    panels: list[tuple[str, list[Measured]]] = []
    for problem in dict.fromkeys(each.problem.title for each in measured):
        own = [each for each in measured if each.problem.title == problem]
        if len(own) <= len(_MARKS):
            panels.append((problem, own))
            continue
        for quantity in dict.fromkeys(each.expected.quantity for each in own):
            some = [each for each in own if each.expected.quantity == quantity]
            panels.append((f"{problem}: {quantity}", some))
    return panels


def paint_exact(panels: Sequence[tuple[str, Sequence[Measured]]], figure: Figure) -> None:
    """All panels, two beside each other."""
    rows = max(1, math.ceil(len(panels) / _COLUMNS))
    grid = figure.subplots(rows, _COLUMNS, squeeze=False).ravel()
    for axes, (title, lines) in zip(grid, panels, strict=False):
        _paint(axes, title, lines)
    for axes in grid[len(panels) :]:
        axes.set_axis_off()
    for axes in grid[::_COLUMNS]:
        axes.set_ylabel("relative error", fontsize="small")
    figure.suptitle(_HOW, fontsize="small", x=0.01, ha="left")


def _paint(axes: Axes, title: str, lines: Sequence[Measured]) -> None:
    axes.set(xscale="log", yscale="log")
    axes.set_title(title, loc="left", fontsize="medium", pad=6 + _LINE_PT * len(lines))
    axes.set_xlabel(lines[0].problem.cost, fontsize="small")
    axes.tick_params(labelsize="small")
    for line, (colour, marker) in zip(lines, _MARKS, strict=False):
        costs, errors = zip(*_points(line), strict=True)
        label = f"{_name(line, title)}: {_typeset(line.expected.order)} in {line.knob.word}"
        axes.plot(costs, errors, color=colour, marker=marker, markersize=5, label=label)
        axes.plot(costs, _expected(line), color=GREY, linestyle=DASHED, linewidth=0.9, zorder=1)
    _widen(axes)
    _label(axes, lines)
    _ticks(axes)
    legend = axes.legend(
        loc="lower left",
        bbox_to_anchor=(-0.04, 1.0),
        fontsize="small",
        handlelength=1.2,
        handletextpad=0.4,
        labelspacing=0.15,
    )
    legend.set_in_layout(False)  # the title makes room for it; it may be wider than the panel


def _name(line: Measured, panel: str) -> str:
    """A line's name, without what the panel's title says."""
    return line.knob.title if panel.endswith(f": {line.expected.quantity}") else line.title


def _typeset(order: float) -> str:
    return f"{order:g}".replace("-", "\u2212")


def _points(line: Measured) -> list[tuple[float, float]]:
    """Cost and error of what a logarithm has a place for, the finest first."""
    pairs = zip(line.costs, line.errors, strict=True)
    return [(cost, error) for cost, error in pairs if cost > 0.0 and error > 0.0]


def _expected(line: Measured) -> list[float]:
    """What the errors would be if the finest were right, and the order the expected one."""
    pairs = zip(line.knob_values, line.costs, line.errors, strict=True)
    known = [(value, error) for value, cost, error in pairs if cost > 0.0 and error > 0.0]
    finest, least = known[0]
    return [float(least * (value / finest) ** line.expected.order) for value, _ in known]


def _widen(axes: Axes) -> None:
    """Make room for the labels."""
    low, high = np.log10(axes.get_xlim())
    axes.set_xlim(10.0**low, 10.0 ** (high + _ROOM * (high - low)))


def _label(axes: Axes, lines: Sequence[Measured]) -> None:
    """The fitted orders beside the finest points, moved apart where they would meet."""
    low, high = np.log10(axes.get_ylim())
    ends = [_points(line)[0] for line in lines]
    heights = apart([(math.log10(error) - low) / (high - low) for _, error in ends], _APART)
    for line, (cost, _), height, (colour, _) in zip(lines, ends, heights, _MARKS, strict=False):
        axes.annotate(
            # A zero has no sign.
            fixed(round(line.order, 2) + 0.0, 2) + ("" if line.is_right else " off"),
            (cost, height),
            xycoords=("data", "axes fraction"),
            xytext=(6, 0),
            textcoords="offset points",
            va="center",
            color=colour,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8, "alpha": 0.8},
            fontsize="small",
            zorder=2.2,  # above the lines, below the frame
            fontweight="normal" if line.is_right else "bold",
        )


def apart(heights: Sequence[float], least: float) -> list[float]:
    """Heights up to 1 moved so that all are at least so far apart, their order kept."""
    order = np.argsort(heights, kind="stable")
    steps = least * np.arange(len(order))
    # Upwards as far as those below ask for it, then down as far as those above and the end do.
    lifted = np.maximum.accumulate(np.asarray(heights)[order] - steps) + steps
    found = np.empty(len(order))
    found[order] = np.minimum(lifted, 1.0 - steps[::-1])
    return [float(height) for height in found]


def _ticks(axes: Axes) -> None:
    for axis, limits, name in (
        (axes.xaxis, axes.get_xlim(), partial(number, digits=1)),
        (axes.yaxis, axes.get_ylim(), _power),
    ):
        ticks = _powers(*limits) or log_ticks(*limits)
        ticks = ticks[:: max(1, math.ceil(len(ticks) / _MOST_TICKS))]
        tick_at(axis, ticks, [name(tick) for tick in ticks])


def _powers(low: float, high: float) -> list[float]:
    """The powers of ten in a range, if there are two of them."""
    first, last = math.ceil(math.log10(low)), math.floor(math.log10(high))
    return [10.0**n for n in range(first, last + 1)] if last > first else []


def _power(tick: float) -> str:
    """A power of ten, or a few of them."""
    mantissa, exponent = f"{tick:.0e}".split("e")
    several = "" if mantissa == "1" else rf"{mantissa}\times"
    return rf"${several}10^{{{int(exponent)}}}$"
