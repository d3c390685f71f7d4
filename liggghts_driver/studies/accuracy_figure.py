"""The figure of a study of accuracy: error against cost, a colour for each knob."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

from matplotlib.ticker import FixedFormatter, FixedLocator, NullLocator

from liggghts_driver.report.numbers import number
from liggghts_driver.report.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    PURPLE,
    VERMILION,
    draw,
    log_ticks,
)
from liggghts_driver.studies.accuracy import pareto

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.figure import Figure

    from liggghts_driver.studies.accuracy import Judged

_HEIGHT_IN = 4.6
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
    "drag": "drag refreshed less",
    "stiffness": "softer contacts",
    "section": "smaller section",
    "window": "shorter average",
    "together": "several together",
}
#: Errors below this are drawn there: a logarithm has no place for zero.
_LEAST = 1e-4


def draw_accuracy(judged: Sequence[Judged], name: str, title: str, noise: float) -> bytes:
    """A PNG: relative error of one quantity over the cost, on logarithmic axes.

    Parameters
    ----------
    judged
        Every setting; the reference itself is left out.
    name, title
        The quantity, and what people call it.
    noise
        Half the 95 % interval of the reference itself, over its mean; nan where it is not known.
    """
    return draw(partial(paint_accuracy, judged, name, title, noise), _HEIGHT_IN)


def paint_accuracy(
    judged: Sequence[Judged], name: str, title: str, noise: float, figure: Figure
) -> None:
    """Points with their intervals, the noise shaded below, the front of the best as a line."""
    axes = figure.subplots()
    axes.set(xscale="log", yscale="log")
    axes.set_xlabel("core time / core time of the reference")
    axes.set_ylabel(f"error of the {title} [%]")
    shown = [j for j in judged if j.setting.knob in _MARKS and name in j.errors]
    for knob, (colour, marker) in _MARKS.items():
        own = [j for j in shown if j.setting.knob == knob]
        for n, each in enumerate(own):
            error = 100.0 * max(abs(each.errors[name].mean), _LEAST)
            half = 100.0 * (each.errors[name].ci95 or 0.0)
            low = max(error - half, 100.0 * _LEAST)
            axes.errorbar(
                each.cost,
                error,
                yerr=[[error - low], [half]],
                color=colour,
                marker=marker,
                markersize=9 if marker == "*" else 6,
                linewidth=1.0,
                capsize=2,
                label=_TITLES[knob] if n == 0 else None,
            )
    front = pareto(shown, name)
    places = _places(front, name)
    axes.plot(
        *zip(*places, strict=True), color=GREY, linewidth=1.5, zorder=0, label="best there is"
    )
    # An interval that reaches zero has no end on this axis.
    bottom = 0.3 * min(error for _, error in _places(shown, name))
    if math.isfinite(noise):
        axes.axhspan(bottom, 100.0 * noise, color=GREY, alpha=0.2, linewidth=0, label="packings")
    axes.set_ylim(bottom=bottom)
    for axis, limits in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
        ticks = log_ticks(*limits)
        axis.set_major_locator(FixedLocator(ticks))
        axis.set_major_formatter(FixedFormatter([number(tick, 1) for tick in ticks]))
        axis.set_minor_locator(NullLocator())
    figure.legend(loc="outside upper center", ncols=2, frameon=False)


def _places(judged: Sequence[Judged], name: str) -> list[tuple[float, float]]:
    """Cost and error in per cent of each."""
    return [(j.cost, 100.0 * max(abs(j.errors[name].mean), _LEAST)) for j in judged]
