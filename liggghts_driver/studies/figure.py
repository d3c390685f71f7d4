"""The figure of a study of effects: what each costs, and what it changes."""

from __future__ import annotations

import textwrap
from functools import partial
from typing import TYPE_CHECKING, Any

from liggghts_driver.report.numbers import number, with_error
from liggghts_driver.report.style import BLUE, GREY, INK, VERMILION, draw
from liggghts_driver.studies.observables import title_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Inches for each effect left out, and for the axes below and the titles above.
_ROW_IN, _MARGIN_IN = 0.62, 1.25
#: Letters that fit below a panel.
_LETTERS = 22
#: A row is 1 high: the bar or point stands below its middle, its numbers above.
_BELOW, _ABOVE, _BAR = 0.14, -0.3, 0.34


def draw_effects(results: Mapping[str, Any]) -> bytes:
    """A PNG: at left the time of the engine over that of the full scene, with its range over the
    replicates; at right the relative change of the main observable with its 95 % interval.
    """  # noqa: D205 - two panels need two lines
    rows = [variant for variant in results["variants"] if variant["left_out"]]
    paint = partial(paint_effects, rows, results["main_observable"])
    return draw(paint, _MARGIN_IN + _ROW_IN * len(rows))


def paint_effects(rows: Sequence[Mapping[str, Any]], main: str, figure: Figure) -> None:
    """Two panels that share their rows, one for each effect left out."""
    times, changes = figure.subplots(1, 2, sharey=True)
    times.set(ylim=(len(rows) - 0.4, -0.6), xlabel="time / time of\nthe full scene")
    changes.set(xlabel=textwrap.fill(f"change of {title_of(main)} [%]", _LETTERS))
    for axes in (times, changes):
        axes.grid(visible=False, axis="y")
        # The rows are named by texts: ticks would be chosen by number, not one for each row.
        axes.tick_params(axis="y", left=False, labelleft=False)
        axes.spines["left"].set_visible(False)
    times.axvline(1.0, color=GREY, linewidth=1.0)
    changes.axvline(0.0, color=GREY, linewidth=1.0)
    for place, row in enumerate(rows):
        beside = times.get_yaxis_transform()
        name = row["title"].replace(" ", "\n", 1)
        times.text(-0.05, place, name, ha="right", va="center", transform=beside)
        _time(times, place, row["time_ratio"])
        _change(changes, place, _main_change(row, main))
    times.set_xlim(0.0, max(1.1, times.get_xlim()[1]))
    changes.margins(x=0.15)


def _main_change(row: Mapping[str, Any], main: str) -> Mapping[str, float | None] | None:
    found: Mapping[str, float | None] | None = next(
        (item["change"] for item in row["observables"] if item["name"] == main), None
    )
    return found


def _words(axes: Axes, place: int, text: str) -> None:
    """Numbers of a row, at the left of its panel, where they meet nothing."""
    beside = axes.get_yaxis_transform()
    words = axes.text(0.03, place + _ABOVE, text, va="center", fontsize="small", transform=beside)
    words.set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 1.0})  # over the lines


def _time(axes: Axes, place: int, ratio: Mapping[str, float] | None) -> None:
    if ratio is None:
        _words(axes, place, "no finished run")
        return
    median, low, high = ratio["median"], ratio["smallest"], ratio["largest"]
    axes.barh(place + _BELOW, median, height=_BAR, color=BLUE)
    axes.errorbar(
        median,
        place + _BELOW,
        xerr=[[median - low], [high - median]],
        color=INK,
        capsize=3,
        linewidth=1.2,
    )
    spread = f" ({number(low)} to {number(high)})" if ratio["replicates"] > 1 else ""
    _words(axes, place, number(median) + spread)


def _change(axes: Axes, place: int, change: Mapping[str, float | None] | None) -> None:
    if change is None or change["mean"] is None:
        _words(axes, place, "not known")
        return
    mean = 100.0 * change["mean"]
    error = None if change["ci95"] is None else 100.0 * change["ci95"]
    axes.errorbar(
        mean,
        place + _BELOW,
        xerr=error,
        color=VERMILION,
        marker="o",
        markersize=6,
        capsize=3,
        linewidth=1.6,
    )
    _words(axes, place, f"{with_error(mean, error)} %")
