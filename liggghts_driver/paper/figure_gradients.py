"""Flow rate, its local exponent, and velocity against the pressure gradient."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D

from liggghts_driver.paper import law
from liggghts_driver.paper.answers import FLOW_UNIT, SECTIONS
from liggghts_driver.paper.catalogue import ALL_GRADIENTS, FOLLOWS, PRINTED
from liggghts_driver.paper.pooled import (
    by_gradient,
    flows_by_gradient,
    local_exponents,
    velocity,
    velocity_range,
)
from liggghts_driver.paper.printed import LARGEST_REYNOLDS, TABLE_1
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
#: Series, colour, marker, and how far aside it stands, so that intervals do not cover each other.
_LOOKS: tuple[tuple[Series, str, str, float], ...] = (
    (ALL_GRADIENTS, BLUE, "o", 0.97),
    (PRINTED, VERMILION, "s", 1.03),
    (FOLLOWS, GREEN, "^", 1.0),
)
_PAPER: Any = {"color": INK, "marker": "D", "markersize": 4.5, "linestyle": "none"}
_EXPONENTS = (-0.2, 1.6)


def paint_flow(stored: Stored, figure: Figure) -> None:
    """Above, flow rates with law and paper; below, the local exponents; a column each section."""
    grid = figure.subplots(2, 2, sharex=True, sharey="row", height_ratios=(1.6, 1.0))
    for column, section in enumerate(SECTIONS):
        above, below = grid[0, column], grid[1, column]
        _law_line(above, lambda g: law.law_flow_m3_s(g) / FLOW_UNIT)
        printed = {row.gradient_pa_m: row.flow_m3_s(section) for row in TABLE_1}
        above.plot(list(printed), [v / FLOW_UNIT for v in printed.values()], **_PAPER)
        _exponents_of(below, printed)
        for series, colour, marker, aside in _LOOKS:
            flows = flows_by_gradient(stored, series, section)
            _flows(above, flows, colour, marker, aside)
            _exponents(below, local_exponents(flows), colour, marker)
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
    figure.legend(handles=[*_handles(_LOOKS), free_flight], loc="outside upper left", ncols=2)


def paint_velocity(stored: Stored, figure: Figure) -> None:
    """Mean velocity of the flowing particles: law, free flight, the paper's range, ours."""
    axes = figure.add_subplot()
    _law_line(axes, lambda g: 1e3 * law.law_velocity_m_s(g))
    gradients = np.geomspace(_LOW, _HIGH, 120)
    axes.plot(gradients, [1e3 * law.free_flight_m_s(g) for g in gradients], color=GREY)
    for row in TABLE_1:
        place = [row.gradient_pa_m] * 2
        axes.plot(place, [1e3 * v for v in row.velocity_m_s], color=INK, linewidth=4, alpha=0.6)
    looks = [(ALL_GRADIENTS, *_LOOKS[0][1:]), _LOOKS[1]]
    for series, colour, marker, aside in looks:
        for gradient, points in by_gradient(stored, series).items():
            mean, reach = velocity(points), velocity_range(points)
            if mean is not None and reach is not None:
                axes.plot([aside * gradient] * 2, [1e3 * v for v in reach], color=colour)
                axes.plot(aside * gradient, 1e3 * mean.mean, marker, color=colour, markersize=5)
    _dress(axes)
    axes.set(xlabel="pressure gradient [Pa/m]", ylabel="velocity of the flowing particles [mm/s]")
    handles = _handles(looks, paper=False)
    handles += [
        Line2D([], [], color=INK, linewidth=4, alpha=0.6, label="paper's DEM, range"),
        Line2D([], [], color=GREY, label="free flight"),
    ]
    figure.legend(handles=handles, loc="outside upper left", ncols=2)


def _law_line(axes: Axes, value: Any) -> None:
    """The law, dashed where it is said to hold, dotted beyond."""
    gradients = np.geomspace(_LOW, _HIGH, 60)
    heights = np.array([value(g) for g in gradients])
    slow = np.array([law.law_reynolds(g) <= LARGEST_REYNOLDS for g in gradients])
    for where, style in ((slow, DASHED), (~slow, ":")):
        axes.plot(gradients, np.where(where, heights, np.nan), color=INK, linestyle=style)


def _flows(
    axes: Axes, flows: Mapping[float, Pooled], colour: str, marker: str, aside: float
) -> None:
    known = {g: p for g, p in flows.items() if p.mean > 0.0}
    if not known:
        return
    low = [min(p.half_width or 0.0, 0.9 * p.mean) / FLOW_UNIT for p in known.values()]
    high = [(p.half_width or 0.0) / FLOW_UNIT for p in known.values()]
    bars: Any = {"yerr": [low, high], "fmt": marker, "capsize": 2.5, "markersize": 5}
    heights = [p.mean / FLOW_UNIT for p in known.values()]
    axes.errorbar([aside * g for g in known], heights, color=colour, linewidth=1.2, **bars)


def _exponents(
    axes: Axes, local: Mapping[tuple[float, float], Pooled], colour: str, marker: str
) -> None:
    for (low, high), pooled in local.items():
        bars: Any = {"yerr": pooled.between, "fmt": marker, "capsize": 2.5, "markersize": 4}
        axes.errorbar(math.sqrt(low * high), pooled.mean, color=colour, linewidth=1.0, **bars)


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
