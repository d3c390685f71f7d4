"""What explains the difference from the paper: how densely particles lie, and each reading."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.paper import law
from liggghts_driver.paper.catalogue import (
    AS_PRINTED,
    CUT_AT_HALF,
    FOLLOWS,
    MAIN,
    PRINTED,
    READINGS,
    SETTINGS,
    TABLE_READINGS,
)
from liggghts_driver.paper.changes import sensitivity
from liggghts_driver.paper.pooled import answers_of, at_ten, by_gradient, of_reading, velocity
from liggghts_driver.paper.printed import MAIN_GRADIENT_PA_M, ROWS
from liggghts_driver.paper.words import listed
from liggghts_driver.report.numbers import number

if TYPE_CHECKING:
    from collections.abc import Iterator

    from liggghts_driver.paper.stored import Answer, Stored


#: Sweeps with other grains, another outside fluid, or other settings.
_OTHERWISE = (CUT_AT_HALF.sweep, AS_PRINTED.sweep, SETTINGS.sweep)


def explain_answer(stored: Stored) -> list[str]:
    """What explains the difference from the paper, as far as the runs tell."""
    return [*_crowding(stored), *sensitivity(stored)]


def _crowding(stored: Stored) -> Iterator[str]:
    """How much of the pores particles fill, how much of that flows, and how fast."""
    points = at_ten(stored, MAIN)
    speed, row = velocity(points), ROWS[MAIN_GRADIENT_PA_M]
    answers = answers_of(points).values()
    if speed is None or not answers:
        return
    printed_speed = float(np.mean(row.velocity_m_s))
    printed = law.flowing_share(row.entrance_m3_s, printed_speed)
    inside, flowing = (
        float(np.mean(counts)) * law.share_of_one()
        for counts in ([a.inside for a in answers], [a.flowing for a in answers])
    )
    free = law.free_flight_m_s(MAIN_GRADIENT_PA_M)
    yield (
        f"At the end particles fill {number(inside, 2)} of the specimen's pores, those that flow "
        f"{number(flowing, 2)}; flow rate over velocity and pores, the share that flows, is "
        f"{number(printed, 2)} in the paper's numbers at {MAIN_GRADIENT_PA_M:g} Pa/m, as in the "
        f"reservoir. Ours go at {number(speed.mean / free, 2)} of free flight, the paper's at "
        f"{number(printed_speed / free, 2)}."
    )
    yield from _held_back(stored)
    yield from _pushed(stored)
    yield from _piled(stored)


def _held_back(stored: Stored) -> Iterator[str]:
    """How the velocity goes with the number of particles inside: same grains and fluids."""
    found = {}
    for reading in (each for each in READINGS if each.sweep not in _OTHERWISE):
        points = of_reading(stored, reading)
        speed = velocity(points)
        if speed is not None:
            inside = [answer.inside for answer in answers_of(points).values()]
            found[float(np.mean(inside))] = speed.mean
    if len(found) > 1:
        few, many = min(found), max(found)
        low, high = (number(1e3 * v) for v in (min(found.values()), max(found.values())))
        yield (
            f"The readings with these grains and this outside fluid have {number(round(few))} to "
            f"{number(round(many))} particles inside at the end, and mean velocities of {low} to "
            f"{high} mm/s: there mainly the grains hold particles back, and not their number."
        )


def _pushed(stored: Stored) -> Iterator[str]:
    """The velocity over free flight, which falls with the gradient where those behind push."""
    told = []
    for series in (MAIN, PRINTED, FOLLOWS):
        ratios = {
            gradient: mean.mean / law.free_flight_m_s(gradient)
            for gradient, points in by_gradient(stored, series).items()
            if (mean := velocity(points)) is not None
        }
        if len(ratios) > 1:
            parts = [f"{number(ratio, 2)} at {gradient:g}" for gradient, ratio in ratios.items()]
            told.append(f"*{series.name}*, {listed(parts)} Pa/m")
    if told:
        yield (
            f"Velocity over free flight: {'; '.join(told)}. The grains alone would leave it about "
            "the same at every gradient; where it falls as the gradient rises, something pushes "
            "from behind that does not go with the gradient."
        )


def _piled(stored: Stored) -> Iterator[str]:
    """How densely particles lie before the entrance at the end; the law has the reservoir's."""
    fraction = law.example().particles.volume_fraction
    assert fraction is not None
    for series in TABLE_READINGS:
        found = [_before_entrance(a) for a in answers_of(at_ten(stored, series)).values()]
        if found:
            dense = float(np.mean(found))
            yield (
                f"*{series.name}*: between piston and entrance particles fill {number(dense, 2)} "
                f"of the channel when the runs end, {number(dense / fraction, 2)} times the "
                f"{fraction:g} that the law counts with from the reservoir to the exit, and more "
                "than this where grains reach into the channel, which are not taken off."
            )


def _before_entrance(answer: Answer) -> float:
    """The volume fraction of particles between the piston and the entrance at the end of a run."""
    scene = law.example()
    assert scene.specimen is not None
    assert scene.particles.volume_fraction is not None
    area_m2, places_m = scene.specimen.width**2, np.array(answer.curves.piston_x_um) * 1e-6
    all_m3 = scene.particles.volume_fraction * area_m2 * -places_m[0]
    past_m3 = answer.curves.passed_m3("entrance", 0)
    return float((all_m3 - past_m3) / (area_m2 * -places_m[-1]))
