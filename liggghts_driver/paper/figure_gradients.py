"""Flow rate, its local exponent, and velocity against the pressure gradient."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D

from liggghts_driver.paper import law
from liggghts_driver.paper.catalogue import ALL_GRADIENTS, FOLLOWS, PRINTED
from liggghts_driver.paper.figure_marks import face
from liggghts_driver.paper.pooled import (
    by_gradient,
    flows_by_gradient,
    local_exponents,
    velocity,
    velocity_range,
)
from liggghts_driver.paper.printed import LARGEST_REYNOLDS, SECTIONS, TABLE_1
from liggghts_driver.paper.words import FLOW_UNIT
from liggghts_driver.report.style import (
    BLUE,
    DASHED,
    GREEN,
    GREY,
    INK,
    PALE,
    VERMILION,
    tick_at,
    tick_log,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from liggghts_driver.paper.catalogue import Series
    from liggghts_driver.paper.pooled import Pooled
    from liggghts_driver.paper.stored import Stored

_LOW, _HIGH = 0.4, 130.0
#: Rates are shown from there on [1e-6 m3/s]; bars that go farther down leave the panel.
_LEAST_RATE = 0.02
#: Series, colour, marker, and how far aside it stands: so little that it is at its gradient still.
_LOOKS: tuple[tuple[Series, str, str, float], ...] = (
    (ALL_GRADIENTS, BLUE, "o", 1.0),
    (PRINTED, VERMILION, "s", 1.04),
    (FOLLOWS, GREEN, "^", 0.96),
)
#: The paper's stands in front of the others, with a rim that parts them.
_PAPER: Any = {
    "color": INK, "marker": "D", "markersize": 5.5, "linestyle": "none", "zorder": 4.0,
    "markeredgecolor": "white", "markeredgewidth": 0.5,
}  # fmt: skip
_EXPONENTS = (-0.3, 1.5)
_PAPER_RANGE: Any = {"color": INK, "linewidth": 4.0, "solid_capstyle": "butt"}
_FREE_FLIGHT: Any = {"color": GREY, "linewidth": 1.0}
#: How far an arrow goes down, as a share of the mean, where the interval goes on to zero.
_ARROW = 0.6
#: How opaque a rate is drawn that still comes up at the end of the run.
_RISING = 0.4


def paint_flow(stored: Stored, figure: Figure) -> None:
    """Above, flow rates with law and paper; below, the local exponents; a column each section."""
    grid = figure.subplots(2, 2, sharex=True, sharey="row", height_ratios=(1.6, 1.0))
    looks = [look for look in _LOOKS if _has_run(stored, look[0])]
    for column, section in enumerate(SECTIONS):
        above, below = grid[0, column], grid[1, column]
        _law_line(above, lambda g: law.law_flow_m3_s(g) / FLOW_UNIT)
        printed = {row.gradient_pa_m: row.flow_m3_s(section) for row in TABLE_1}
        above.plot(list(printed), [v / FLOW_UNIT for v in printed.values()], **_PAPER)
        _exponents_of(below, printed)
        for series, colour, marker, aside in looks:
            flows = flows_by_gradient(stored, series, section)
            _flows(above, flows, colour, marker, aside)
            _exponents(below, local_exponents(flows), colour, marker, aside)
        above.set_ylim(bottom=max(_LEAST_RATE, above.get_ylim()[0]))
        _dress(above)
        _reynolds_axis(above)
        below.axhline(1.0, color=INK, linestyle=DASHED, linewidth=1.0)
        gradients = np.geomspace(_LOW, _HIGH, 60)
        free = [law.free_flight_exponent(g / 1.05, g * 1.05) for g in gradients]
        below.plot(gradients, free, color=GREY, linewidth=1.0)
        below.set(xlabel="pressure gradient [Pa/m]", ylim=_EXPONENTS)
        above.set_title(section, fontsize="medium")
    grid[0, 0].set_ylabel("particle flow rate [10⁻⁶ m³/s]")
    grid[1, 0].set_ylabel("local exponent")
    free_flight = Line2D([], [], color=GREY, linewidth=1.0, label="free flight (exponent)")
    figure.legend(handles=[*_handles(looks), free_flight], loc="outside upper left", ncols=2)


def _has_run(stored: Stored, series: Series) -> bool:
    """Whether any point of its own has an answer, beside those that it shares with another."""
    own = [name for name, gradients in series.parts.items() if not gradients]
    return any(point.sound is not None for name in own for point in stored.points(name))


def paint_velocity(stored: Stored, figure: Figure) -> None:
    """Mean velocity of the flowing particles: law, free flight, the paper's range, ours."""
    axes = figure.add_subplot()
    _law_line(axes, lambda g: 1e3 * law.law_velocity_m_s(g))
    gradients = np.geomspace(_LOW, _HIGH, 120)
    axes.plot(gradients, [1e3 * law.free_flight_m_s(g) for g in gradients], **_FREE_FLIGHT)
    for row in TABLE_1:
        place = [row.gradient_pa_m] * 2
        axes.plot(place, [1e3 * v for v in row.velocity_m_s], **_PAPER_RANGE)
    looks = [look for look in _LOOKS[:2] if _has_run(stored, look[0])]
    for series, colour, marker, aside in looks:
        for gradient, points in by_gradient(stored, series).items():
            mean, reach = velocity(points), velocity_range(points)
            if mean is not None and reach is not None:
                axes.plot([aside * gradient] * 2, [1e3 * v for v in reach], color=colour)
                look: Any = {"color": colour, "markersize": 5, "mfc": face(mean, colour)}
                axes.plot(aside * gradient, 1e3 * mean.mean, marker, **look)
    _dress(axes)
    axes.set(xlabel="pressure gradient [Pa/m]", ylabel="velocity of the flowing particles [mm/s]")
    handles = _handles(looks, paper=False)
    handles += [
        Line2D([], [], label="paper's DEM, range in time", **_PAPER_RANGE),
        Line2D([], [], label="free flight", **_FREE_FLIGHT),
    ]
    figure.legend(handles=handles, loc="outside upper left", ncols=2)


def _law_line(axes: Axes, value: Any) -> None:
    """The law, dashed where it is said to hold, dotted beyond."""
    gradients = np.geomspace(_LOW, _HIGH, 60)
    heights = np.array([value(g) for g in gradients])
    slow = np.array([law.is_slow(g) for g in gradients])
    for where, style in ((slow, DASHED), (~slow, ":")):
        axes.plot(gradients, np.where(where, heights, np.nan), color=INK, linestyle=style)


def _flows(
    axes: Axes, flows: Mapping[float, Pooled], colour: str, marker: str, aside: float
) -> None:
    groups: dict[tuple[str, float], dict[float, Pooled]] = {}
    for gradient, pooled in flows.items():
        if pooled.mean > 0.0:
            look = (face(pooled, colour), _RISING if pooled.rising else 1.0)
            groups.setdefault(look, {})[gradient] = pooled
    for (filled, alpha), some in groups.items():
        style = {"fmt": marker, "color": colour, "mfc": filled, "alpha": alpha}
        _with_bars(axes, some, aside, style)


def _with_bars(axes: Axes, flows: Mapping[float, Pooled], aside: float, look: Any) -> None:
    """Markers with their intervals; an arrow down from where the interval goes on to zero."""
    places = [aside * gradient for gradient in flows]
    means = np.array([pooled.mean for pooled in flows.values()]) / FLOW_UNIT
    halves = np.array([pooled.half_width or 0.0 for pooled in flows.values()]) / FLOW_UNIT
    open_ended = halves >= means
    bars: Any = {"capsize": 2.5, "markersize": 5, "linewidth": 1.2}
    lower = np.where(open_ended, 0.0, halves)
    axes.errorbar(places, means, yerr=[lower, halves], **look, **bars)
    if open_ended.any():
        ends, arrow = means[open_ended], {**look, "fmt": "none"}
        below = np.array(places)[open_ended]
        axes.errorbar(below, ends, yerr=_ARROW * ends, uplims=True, **arrow, **bars)


def _exponents(
    axes: Axes,
    local: Mapping[tuple[float, float], Pooled],
    colour: str,
    marker: str,
    aside: float,
) -> None:
    for (low, high), pooled in local.items():
        place = aside * math.sqrt(low * high)
        bars: Any = {"yerr": pooled.half_width, "fmt": marker, "capsize": 2.5, "markersize": 4}
        bars["mfc"] = face(pooled, colour)
        axes.errorbar(place, pooled.mean, color=colour, linewidth=1.0, **bars)
        _beyond(axes, place, pooled.mean, colour)


def _beyond(axes: Axes, place: float, exponent: float, colour: str) -> None:
    """A triangle at the edge where an exponent lies outside of the panel."""
    low, high = _EXPONENTS
    if low <= exponent <= high:
        return
    height, marker = (high - 0.07, "^") if exponent > high else (low + 0.07, "v")
    axes.plot(place, height, marker, color=colour, markersize=5)


def _exponents_of(axes: Axes, flows: Mapping[float, float]) -> None:
    """The paper's."""
    gradients, rates = np.log(list(flows)), np.log(list(flows.values()))
    middles = np.exp(0.5 * (gradients[1:] + gradients[:-1]))
    axes.plot(middles, np.diff(rates) / np.diff(gradients), **_PAPER)


def _dress(axes: Axes) -> None:
    axes.set(xscale="log", yscale="log", xlim=(_LOW, _HIGH))
    bottom, top = axes.get_ylim()
    for axis, (low, high) in ((axes.xaxis, (_LOW, _HIGH)), (axes.yaxis, (bottom, top))):
        tick_log(axis, low, high)
    limit = LARGEST_REYNOLDS / law.law_reynolds(1.0)
    axes.axvspan(limit, _HIGH, color=PALE, alpha=0.35, zorder=0)


def _reynolds_axis(axes: Axes) -> None:
    scale = law.law_reynolds(1.0)
    above = axes.secondary_xaxis(
        "top", functions=(partial(np.multiply, scale), partial(np.multiply, 1.0 / scale))
    )
    ticks = [1.0, 10.0]
    tick_at(above.xaxis, ticks, [f"Re {tick:g}" for tick in ticks])


def _handles(
    looks: Sequence[tuple[Series, str, str, float]], *, paper: bool = True
) -> list[Line2D]:
    own = [
        Line2D([], [], color=colour, marker=marker, linestyle="none", label=series.name)
        for series, colour, marker, _ in looks
    ]
    printed = [Line2D([], [], label="paper's DEM", **_PAPER)] if paper else []
    return [Line2D([], [], color=INK, linestyle=DASHED, label="law"), *printed, *own]
