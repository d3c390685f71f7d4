"""The figure of a study of accuracy: error against cost, a colour for each knob."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

from liggghts_driver.report.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    PURPLE,
    VERMILION,
    draw,
    tick_log,
)
from liggghts_driver.studies.accuracy import pareto

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from liggghts_driver.studies.accuracy import Judged

_HEIGHT_IN, _LEGEND_IN = 3.2, 1.2
#: Colour and marker of each knob, told apart without colour too.
_MARKS = {
    "step": (BLUE, "o"),
    "drag": (GREEN, "s"),
    "stiffness": (VERMILION, "^"),
    "section": (PURPLE, "D"),
    "window": (ORANGE, "v"),
    "together": (INK, "*"),
}
_TITLES = {
    "step": "time step",
    "drag": "drag kept, implicit",
    "stiffness": "softer contacts",
    "section": "smaller section",
    "window": "shorter average",
    "together": "several together",
}
_FRONT = "known to hold (95 %)"
_NOISE = "spread of packings (95 %)"
_HOLLOW = "not told from none"
#: Errors below this are drawn there: a logarithm has no place for zero.
_LEAST = 1e-4


def draw_accuracy(
    judged: Sequence[Judged], panels: Mapping[str, str], noises: Mapping[str, float]
) -> bytes:
    """A PNG: relative errors over the cost, on logarithmic axes, a panel for each quantity.

    Parameters
    ----------
    judged
        Every setting; the reference itself is left out.
    panels
        Each quantity, and what people call it.
    noises
        Half the 95 % interval of the reference itself, over its mean; nan where it is not known.
    """
    height = _HEIGHT_IN * len(panels) + _LEGEND_IN
    return draw(partial(paint_accuracy, judged, panels, noises), height)


def paint_accuracy(
    judged: Sequence[Judged],
    panels: Mapping[str, str],
    noises: Mapping[str, float],
    figure: Figure,
) -> None:
    """Points with their intervals, the noise shaded below, the front of the best as a line."""
    grid = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    for axes, (name, title) in zip(grid, panels.items(), strict=True):
        shown = [j for j in judged if j.setting.knob in _MARKS and name in j.errors]
        _paint(axes, shown, name, noises[name])
        axes.set_ylabel(f"error of the\n{title}")
    grid[-1].set_xlabel("core time / core time of the reference")
    tick_log(grid[-1].xaxis, *grid[-1].get_xlim())
    _legend(figure, list(grid))


def _legend(figure: Figure, grid: Sequence[Axes]) -> None:
    """Each thing once, whatever panels it is in."""
    found: dict[str, Artist] = {}
    for axes in grid:
        handles, labels = axes.get_legend_handles_labels()
        found |= dict(zip(labels, handles, strict=True))
    labels = [label for label in (*_TITLES.values(), _FRONT, _NOISE, _HOLLOW) if label in found]
    handles = [found[label] for label in labels]
    figure.legend(handles, labels, loc="outside upper center", ncols=2, frameon=False)


def _paint(axes: Axes, shown: Sequence[Judged], name: str, noise: float) -> None:
    """One quantity."""
    axes.set(xscale="log", yscale="log")
    costs = {j.cost for j in shown}
    if len(costs) == 1:  # one place alone has no span of its own
        axes.set_xlim(0.5 * min(costs), 2.0 * min(costs))
    places = [(j.cost, 100.0 * max(abs(j.errors[name].mean), _LEAST)) for j in shown]
    # An interval that reaches zero has no end on this axis.
    bottom = 0.5 * min((error for _, error in places), default=1.0)
    for each, (cost, error) in zip(shown, places, strict=True):
        colour, marker = _MARKS[each.setting.knob]
        half = 100.0 * (each.errors[name].ci95 or 0.0)
        low = max(error - half, bottom)
        hollow = each.is_below_noise(name)
        axes.errorbar(
            cost,
            error,
            yerr=[[error - low], [half]],
            color=colour,
            marker=marker,
            markersize=9 if marker == "*" else 6,
            markerfacecolor="white" if hollow else colour,
            linewidth=0.8,
            capsize=2,
            label=_TITLES[each.setting.knob],
        )
    axes.plot([], [], "o", color=GREY, markerfacecolor="white", label=_HOLLOW)
    front = pareto(shown, name)
    if front:
        reaches = [100.0 * j.reach(name) for j in front]
        axes.step([j.cost for j in front], reaches, where="post", color=GREY, label=_FRONT)
    if math.isfinite(noise):
        axes.axhspan(bottom, 100.0 * noise, color=GREY, alpha=0.2, linewidth=0, label=_NOISE)
    axes.set_ylim(bottom=bottom)
    tick_log(axes.yaxis, *axes.get_ylim())
