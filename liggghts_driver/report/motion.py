"""Figures of what moves: the piston, and the particles of a scene without a specimen."""

from __future__ import annotations

from typing import TYPE_CHECKING

from liggghts_driver.report.numbers import quantity, unit_for
from liggghts_driver.report.style import BLUE, DASHED, INK, VERMILION

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from liggghts_driver.results.answer import Answer

#: Resistances below this share of the driving force are not shown: they decide nothing.
_LEAST_RESISTANCE = 0.01


def paint_piston(answer: Answer, driving_force_n: float, figure: Figure) -> None:
    """Path of the piston, and the contacts' resistance beside the force M a that drives it."""
    series = answer.series
    time, place, resistance = series["time_s"], series["piston_x_m"], -series["piston_force_n"]
    length = unit_for("m", float(place.max() - place.min()))
    force = unit_for("N", max(driving_force_n, float(resistance.max())))
    above, below = figure.subplots(2, 1, sharex=True)
    above.plot(time, place / length.size, color=BLUE)
    above.set_ylabel(f"position x [{length.name}]")
    below.plot(time, resistance / force.size, color=VERMILION, label="resistance of the contacts")
    below.axhline(
        force.of(driving_force_n),
        color=INK,
        linestyle=DASHED,
        label=f"driving force, {quantity(driving_force_n, 'N')}",
    )
    below.set_yscale("log", nonpositive="mask")
    below.set_ylim(bottom=force.of(_LEAST_RESISTANCE * driving_force_n))
    below.yaxis.set_major_formatter("{x:g}")
    below.set(xlabel="time [s]", ylabel=f"force [{force.name}]", xlim=(0.0, float(time.iloc[-1])))
    figure.align_ylabels()
    figure.legend(loc="outside upper left", ncols=2)


def paint_motion(answer: Answer, figure: Figure) -> None:
    """Largest speed, with the speed it should end at where that is known; kinetic energy."""
    series = answer.series
    speed, energy = series["largest_speed_m_s"], series["kinetic_energy_j"]
    exact = [
        abs(check["exact"])
        for check in answer.results["exact"]
        if check["name"] == "free_flight_velocity_m_s"
    ]
    time = unit_for("s", float(series["time_s"].iloc[-1]))
    velocity = unit_for("m/s", max([float(speed.max()), *exact]))
    joule = unit_for("J", float(energy.max()))
    above, below = figure.subplots(2, 1, sharex=True)
    above.plot(series["time_s"] / time.size, speed / velocity.size, color=BLUE)
    for value in exact:
        label = f"exact free flight, {quantity(value, 'm/s', 4)}"
        above.axhline(velocity.of(value), color=INK, linestyle=DASHED, label=label)
        figure.legend(loc="outside upper left")
    above.set(ylabel=f"largest speed [{velocity.name}]", ylim=(0.0, None))
    below.plot(series["time_s"] / time.size, energy / joule.size, color=VERMILION)
    below.set(xlabel=f"time [{time.name}]", ylabel=f"kinetic energy [{joule.name}]")
    below.set(ylim=(0.0, None), xlim=(0.0, time.of(float(series["time_s"].iloc[-1]))))
    figure.align_ylabels()
