"""The readings side by side, and what-if charts from the estimator with simulations on top."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D

from liggghts_driver.darcy import estimate
from liggghts_driver.paper import law
from liggghts_driver.paper.catalogue import FRICTIONS, READINGS
from liggghts_driver.paper.figure_marks import face
from liggghts_driver.paper.figure_volumes import SECTION_COLOURS
from liggghts_driver.paper.pooled import flow, of_reading
from liggghts_driver.paper.printed import MAIN_GRADIENT_PA_M, ROWS, SECTIONS
from liggghts_driver.paper.stored import NOT_RUN
from liggghts_driver.paper.varied import FRACTION, POROSITY
from liggghts_driver.paper.words import FLOW_UNIT
from liggghts_driver.prediction import darcy_inputs
from liggghts_driver.report.style import DASHED, GREY, INK, PALE

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from liggghts_driver.darcy import DarcyInputs
    from liggghts_driver.paper.pooled import Pooled
    from liggghts_driver.paper.stored import Stored

_SAMPLES = 121
#: The axis of flow rates ends there, in millionths; intervals may go on.
_WIDEST_RATE = 4.2
#: Right of the paper's values, which words must not cross.
_WORDS_FROM = 2.25
#: Where both lines stand at one place, the narrow dashes lie on the wide pale line.
_PAPER: Any = {"color": PALE, "linewidth": 4.0, "zorder": 1.0}
_LAW: Any = {"color": INK, "linestyle": DASHED, "linewidth": 1.2, "zorder": 1.5}


@dataclass(frozen=True)
class Chart:
    """The law's flow rate of particles [m3/s] against one of its inputs, all others the paper's.

    ``valid`` tells where its inputs are inside the law's validity; ``own`` is the paper's value.
    """

    label: str
    values: NDArray[np.float64]
    flows_m3_s: NDArray[np.float64]
    valid: NDArray[np.bool_]
    own: float
    log: bool = False


def charts() -> tuple[Chart, ...]:
    """Flow rate at 10 Pa/m against particle fraction, porosity, contrast P2/P1 and phi."""
    base = darcy_inputs(law.example())
    p1 = base.permeability_1_m2
    fractions, porosities = np.linspace(0.0, 0.3, _SAMPLES), np.linspace(0.05, 0.95, _SAMPLES)
    contrasts, weights = np.geomspace(1.0, 1e5, _SAMPLES), np.linspace(0.0, 1.0, _SAMPLES)
    several = (
        ("particle fraction $v_p$", fractions, base.particle_fraction, False,
         [replace(base, particle_fraction=v) for v in fractions.tolist()]),
        ("porosity $v_2$", porosities, 1.0 - base.solid_fraction, False,
         [replace(base, solid_fraction=1.0 - v) for v in porosities.tolist()]),
        ("contrast $P_2/P_1$", contrasts, base.permeability_2_m2 / p1, True,
         [replace(base, permeability_2_m2=p1 * v) for v in contrasts.tolist()]),
        (r"$\varphi$", weights, base.phi, False, [replace(base, phi=v) for v in weights.tolist()]),
    )  # fmt: skip
    return tuple(_chart(*each) for each in several)


def _chart(
    label: str, values: NDArray[np.float64], own: float, log: bool, inputs: list[DarcyInputs]
) -> Chart:
    found = [estimate(each, MAIN_GRADIENT_PA_M) for each in inputs]
    flows = np.array([float(np.asarray(each.particle_flow_rate_m3_s)) for each in found])
    valid = np.array([bool(np.all(each.valid)) for each in found])
    return Chart(label, values, flows, valid, own, log)


def paint_what_if(stored: Stored, figure: Figure) -> None:
    """Four charts; simulated points in those whose input was varied in simulations."""
    several = charts()
    grid = figure.subplots(2, 2, sharey=True)
    for axes, chart in zip(grid.flat, several, strict=True):
        for where, style in ((chart.valid, DASHED), (~chart.valid, ":")):
            heights = np.where(where, chart.flows_m3_s / FLOW_UNIT, np.nan)
            axes.plot(chart.values, heights, color=INK, linestyle=style)
        axes.axvline(chart.own, color=GREY, linewidth=0.8)
        axes.set(xlabel=chart.label, xscale="log" if chart.log else "linear")
    for section, colour in SECTION_COLOURS.items():
        for axes, varied in zip(grid[0], (FRACTION, POROSITY), strict=True):
            _points(axes, varied.flows(stored, section), colour)
    grid[0, 0].set(ylim=(0.0, _WIDEST_RATE))
    figure.supylabel("particle flow rate at 10 Pa/m [10⁻⁶ m³/s]", fontsize="medium")
    handles = [
        Line2D([], [], color=INK, linestyle=DASHED, label="law"),
        Line2D([], [], color=INK, linestyle=":", label="law, said not to hold"),
        Line2D([], [], color=GREY, linewidth=0.8, label="input as in the paper"),
        *(
            Line2D([], [], color=c, marker="o", linestyle="none", label=f"simulation, {s}")
            for s, c in SECTION_COLOURS.items()
        ),
    ]
    figure.legend(handles=handles, loc="outside upper left", ncols=2)


def _points(axes: Axes, found: Mapping[float, Pooled], colour: str) -> None:
    bars: Any = {"fmt": "o", "capsize": 2.5, "markersize": 4.5, "linewidth": 1.2}
    for place, pooled in found.items():
        error = None if pooled.half_width is None else pooled.half_width / FLOW_UNIT
        bars["mfc"] = face(pooled, colour)
        axes.errorbar(place, pooled.mean / FLOW_UNIT, yerr=error, color=colour, **bars)


def paint_readings(stored: Stored, figure: Figure) -> None:
    """Every reading at 10 Pa/m: a panel for each section, the paper's value as a line."""
    panels = figure.subplots(1, 2, sharey=True)
    readings = (*READINGS, *FRICTIONS)
    row = ROWS[MAIN_GRADIENT_PA_M]
    for axes, section in zip(panels, SECTIONS, strict=True):
        axes.axvline(row.flow_m3_s(section) / FLOW_UNIT, **_PAPER)
        axes.axvline(law.law_flow_m3_s(row.gradient_pa_m) / FLOW_UNIT, **_LAW)
        for place, reading in enumerate(readings):
            _reading(axes, place, flow(of_reading(stored, reading), section), section)
        axes.set(ylim=(len(readings) - 0.5, -0.5))
        axes.set_xlim(left=0.0, right=_WIDEST_RATE)
        axes.set_xticks(range(5))
        axes.set_title(section, fontsize="medium")
        axes.grid(visible=False, axis="y")
    titles = [reading.title for reading in readings]
    panels[0].set_yticks(range(len(readings)), titles, fontsize="small")
    figure.supxlabel("particle flow rate at 10 Pa/m [10⁻⁶ m³/s]", fontsize="medium")
    handles = [
        Line2D([], [], label="paper's DEM", **_PAPER),
        Line2D([], [], label="law", **_LAW),
        Line2D([], [], color=GREY, marker=".", linestyle="none", label="each packing"),
    ]
    figure.legend(handles=handles, loc="outside upper left", ncols=3)


def _reading(axes: Axes, place: int, pooled: Pooled | None, section: str) -> None:
    if pooled is None:
        words: Any = {"color": GREY, "va": "center", "fontsize": "small"}
        axes.text(_WORDS_FROM, place, NOT_RUN, **words)
        return
    colour = SECTION_COLOURS[section]
    error = None if pooled.half_width is None else pooled.half_width / FLOW_UNIT
    bars: Any = {"fmt": "o", "capsize": 2.5, "markersize": 5, "linewidth": 1.4}
    bars["mfc"] = face(pooled, colour)
    axes.errorbar(pooled.mean / FLOW_UNIT, place, xerr=error, color=colour, **bars)
    single = [value / FLOW_UNIT for value in pooled.values.values()]
    axes.plot(single, [place + 0.25] * len(single), ".", color=GREY, markersize=4)
