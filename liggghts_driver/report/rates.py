"""Figures of the flow through a specimen: accumulated volumes, and the velocity inside it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from liggghts_driver.report.numbers import Unit, number, unit_for, with_error
from liggghts_driver.report.style import BLUE, DASHED, GREEN, INK, SHADE, SKY, VERMILION

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from liggghts_driver.results.answer import Answer

_COLOURS = {"entrance": BLUE, "middle": VERMILION}


def paint_volumes(answer: Answer, figure: Figure) -> None:
    """Volume past each section, the fitted slopes, and the estimate's v_p Q t (Eq. 16)."""
    series, estimate = answer.series, answer.results["estimate"]
    time = series["time_s"]
    volumes = {name: series[f"volume_{name}_m3"] for name in answer.results["sections"]}
    unit = unit_for("m³", max(float(volume.abs().max()) for volume in volumes.values()))
    axes = figure.add_subplot(xlabel="time [s]", ylabel=f"volume of particles [{unit.name}]")
    for name, volume in volumes.items():
        axes.plot(time, volume / unit.size, color=_COLOURS[name], label=f"simulation, {name}")
    if estimate["applies"]:
        flow = unit.of(estimate["particle_flow_rate_m3_s"])
        label = f"estimate $v_p Q t$, {number(flow)} {unit.name}/s"
        axes.plot(time, flow * time, color=INK, linestyle=DASHED, label=label)
    rates = {
        name: section["particle_flow_rate_m3_s"]
        for name, section in answer.results["sections"].items()
    }
    for name, rate in rates.items():
        if rate["mean"] is not None:
            _fit(axes, rate, time, volumes[name], unit, _COLOURS[name])
    _shade([axes], rates.values(), float(time.iloc[-1]))
    figure.legend(loc="outside upper left", ncols=2)


def _fit(
    axes: Axes,
    rate: Mapping[str, Any],
    time: pd.Series[float],
    volume: pd.Series[float],
    unit: Unit,
    colour: str,
) -> None:
    """The fitted slope as a broad band, through the middle of the points it was fitted to."""
    fitted = time >= rate["steady_from_s"]
    line = unit.of(rate["mean"]) * (time - time[fitted].mean()) + volume[fitted].mean() / unit.size
    ci95 = None if rate["ci95"] is None else unit.of(rate["ci95"])
    axes.plot(
        time[fitted],
        line[fitted],
        color=colour,
        alpha=0.3,
        linewidth=8,
        solid_capstyle="butt",
        label=f"slope {with_error(unit.of(rate['mean']), ci95)} {unit.name}/s",
    )


def _shade(panels: list[Axes], parts: Iterable[Mapping[str, Any]], end: float) -> None:
    """Shade the time on which every one of some results rests."""
    known = list(parts)
    start = max(part["steady_from_s"] for part in known)
    label = "steady part" if all(part["steady"] for part in known) else "fitted part, not steady"
    for axes in panels:
        axes.axvspan(start, end, color=SHADE, zorder=0, label=label)
        axes.set_xlim(0.0, end)


def paint_velocity(answer: Answer, figure: Figure) -> None:
    """Mean velocity of the flowing particles beside the estimate's pore velocity q / v_2."""
    series, mean = answer.series, answer.results["flowing_velocity_m_s"]
    estimate = answer.results["estimate"]
    time, velocity = series["time_s"], series["flowing_velocity_m_s"]
    unit = unit_for("m/s", float(velocity.max()))
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    above.plot(time, velocity / unit.size, color=BLUE, label="simulation, flowing particles")
    if estimate["applies"]:
        pore = unit.of(estimate["pore_velocity_m_s"])
        label = f"estimate $q/v_2$, {number(pore)} {unit.name}"
        above.axhline(pore, color=INK, linestyle=DASHED, label=label)
    if mean["mean"] is not None:
        _level(above, mean, unit, float(time.iloc[-1]))
    _shade([above, below], [mean], float(time.iloc[-1]))
    below.plot(time, series["inside"], color=SKY, label="particles inside")
    below.plot(time, series["flowing"], color=GREEN, label="of these flowing")
    above.set(ylabel=f"velocity [{unit.name}]", ylim=(0.0, None))
    below.set(xlabel="time [s]", ylabel="particles [count]", ylim=(0.0, None))
    figure.align_ylabels()
    upper, lower = above.get_legend_handles_labels(), below.get_legend_handles_labels()
    known = dict(zip(upper[1] + lower[1], upper[0] + lower[0], strict=True))
    figure.legend(known.values(), known.keys(), loc="outside upper left", ncols=2)


def _level(axes: Axes, mean: Mapping[str, Any], unit: Unit, end: float) -> None:
    """The mean over the steady part with its 95 % interval."""
    value = unit.of(mean["mean"])
    ci95 = None if mean["ci95"] is None else unit.of(mean["ci95"])
    label = f"mean {with_error(value, ci95)} {unit.name}"
    times = [mean["steady_from_s"], end]
    axes.plot(times, [value, value], color=VERMILION, linewidth=1.4, label=label)
    if ci95 is not None:
        axes.fill_between(times, value - ci95, value + ci95, color=VERMILION, alpha=0.2, lw=0)
