"""What moves the flow and what does not: each reading, friction, and the particle fraction."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.paper import law
from liggghts_driver.paper.answers import FLOW_UNIT, SECTIONS
from liggghts_driver.paper.catalogue import FRICTIONS, MAIN, READINGS, TABLE_READINGS
from liggghts_driver.paper.pooled import by_gradient, flow, of_reading, velocity
from liggghts_driver.paper.printed import MAIN_GRADIENT_PA_M, ROWS
from liggghts_driver.paper.varied import FRACTION, POROSITY
from liggghts_driver.paper.words import NOT_RUN, by_kind, capital, cell, judge
from liggghts_driver.physics.spheres import sphere_volume_m3
from liggghts_driver.report.numbers import decimals_for, fixed, number
from liggghts_driver.studies.paired import paired_change

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from liggghts_driver.paper.catalogue import Reading
    from liggghts_driver.paper.stored import Answer, Point, Stored
    from liggghts_driver.paper.varied import Varied
    from liggghts_driver.studies.paired import Change

#: A flow below this share of that without friction has come to a stop.
_STOPPED = 0.02


def explain_answer(stored: Stored) -> list[str]:
    """What explains the difference from the paper, as far as the runs tell."""
    return [*_crowding(stored), *_sensitivity(stored)]


def _crowding(stored: Stored) -> Iterator[str]:
    """A flow rate over velocity and pores: how much of the pores flows, in the paper and here."""
    points = by_gradient(stored, MAIN).get(MAIN_GRADIENT_PA_M, [])
    speed, rate = velocity(points), flow(points, "entrance")
    scene, row = law.example(), ROWS[MAIN_GRADIENT_PA_M]
    if speed is None or rate is None:
        return
    printed = law.flowing_share(row.entrance_m3_s, float(np.mean(row.velocity_m_s)))
    ours = law.flowing_share(rate.mean, speed.mean)
    free = law.free_flight_m_s(MAIN_GRADIENT_PA_M)
    slow, printed_slow = (v / free for v in (speed.mean, float(np.mean(row.velocity_m_s))))
    yield (
        f"Flow rate over velocity and pores is the share of the pores that flows: "
        f"{number(printed, 2)} in the paper's numbers at {MAIN_GRADIENT_PA_M:g} Pa/m (the "
        f"reservoir has {scene.particles.volume_fraction:g}), {number(ours, 2)} in ours. Ours flow "
        f"at {number(slow, 2)} of free flight, the paper's at {number(printed_slow, 2)}: "
        f"{_denser(ours, printed, slow, printed_slow)}"
    )
    filled = _filled(points)
    if filled is not None:
        yield (
            f"At the end of our runs particles fill {number(filled, 2)} of the specimen's pores, "
            "those that are held among them."
        )
    yield from _piled(stored)


def _piled(stored: Stored) -> Iterator[str]:
    """How densely particles lie before the entrance at the end; the law has the reservoir's."""
    fraction = law.example().particles.volume_fraction
    assert fraction is not None
    for series in TABLE_READINGS:
        points = by_gradient(stored, series).get(MAIN_GRADIENT_PA_M, [])
        found = [_before_entrance(p.sound) for p in points if p.sound is not None]
        if found:
            dense = float(np.mean(found))
            yield (
                f"Between piston and entrance particles fill {number(dense, 2)} of the channel "
                f"when the runs end ({series.title}): {number(dense / fraction, 2)} times the "
                f"{fraction:g} that the law counts with from the reservoir to the exit."
            )


def _before_entrance(answer: Answer) -> float:
    """The volume fraction of particles between the piston and the entrance at the end of a run."""
    scene = law.example()
    assert scene.specimen is not None
    assert scene.particles.volume_fraction is not None
    area_m2, places_m = scene.specimen.width**2, np.array(answer.curves.piston_x_um) * 1e-6
    all_m3 = scene.particles.volume_fraction * area_m2 * -places_m[0]
    past_m3 = answer.curves.volume_mm3["entrance"][-1] * 1e-9
    return float((all_m3 - past_m3) / (area_m2 * -places_m[-1]))


def _denser(ours: float, printed: float, slow: float, printed_slow: float) -> str:
    if ours > printed and slow < printed_slow:
        return "particles in ours are denser and slower, each in the other's way."
    if ours < printed and slow > printed_slow:
        return "particles in ours are more dilute and faster."
    return "the two differ otherwise than by crowding."


def _filled(points: Sequence[Point]) -> float | None:
    """The share of the pores that particles fill at the end, over the packings."""
    scene = law.example()
    specimen, radius = scene.specimen, scene.particles.radius_mean
    inside = [p.sound.inside for p in points if p.sound is not None]
    if not inside or specimen is None or radius is None:
        return None
    pores_m3 = specimen.length * specimen.width**2 * (1.0 - specimen.solid_fraction)
    return float(np.mean(inside)) * sphere_volume_m3(radius) / pores_m3


def change_of(stored: Stored, reading: Reading, section: str) -> Change | None:
    """What a reading changes of a flow rate, packing by packing, from what it differs from."""
    base_reading = reading.beside or READINGS[0]
    own, base = (flow(of_reading(stored, each), section) for each in (reading, base_reading))
    return paired_change(own.values, base.values) if own and base else None


def change_words(change: Change) -> str:
    """A change in per cent with its interval."""
    sign = "+" if change.mean > 0.0 else ""
    if change.ci95 is None:
        return f"{sign}{number(100.0 * change.mean, 2)} %, one packing"
    decimals = decimals_for(100.0 * change.ci95)
    mean, half = (fixed(100.0 * value, decimals) for value in (change.mean, change.ci95))
    return f"{sign}{mean} ± {half} %"


def _sensitivity(stored: Stored) -> Iterator[str]:
    """Which readings change the flow beyond chance, which do not, and of which it is not known."""
    for section in SECTIONS:
        kinds: dict[str, list[str]] = {"moves": [], "not told": [], "one": []}
        for reading in READINGS[1:]:
            change = change_of(stored, reading, section)
            if change is not None:
                kind = "one" if change.ci95 is None else _kind(change)
                kinds[kind].append(f"{reading.title} ({change_words(change)})")
        told = {
            "moves": "what changes the flow beyond chance:",
            "not told": "no change beyond chance:",
            "one": "chance not known:",
        }
        words = by_kind(told, kinds) or NOT_RUN
        yield f"{capital(section)}, beside {READINGS[0].title}: {words}."


def _kind(change: Change) -> str:
    return "moves" if abs(change.mean) > (change.ci95 or 0.0) else "not told"


def friction_answer(stored: Stored) -> list[str]:
    """How much friction slows the flow at the entrance, and whether it stops it."""
    sentences = []
    settings = stored.sweeps[FRICTIONS[0].sweep].settings if stored.sweeps else {}
    rolling = settings.get("contact.rolling_friction", 0.0)
    for reading in FRICTIONS:
        change = change_of(stored, reading, "entrance")
        if change is None:
            sentences.append(f"{capital(reading.title)}: {NOT_RUN}.")
            continue
        end = f"not obstructed: {number(100.0 * (1.0 + change.mean), 2)} % remains"
        if is_stopped(change):
            end = "the entrance is obstructed, as the paper says may happen"
        sentences.append(
            f"{capital(reading.title)}, rolling {rolling:g}: the flow rate at the entrance over "
            f"the second half changes by {change_words(change)}; {end}."
        )
    return sentences


def is_stopped(change: Change) -> bool:
    """Whether hardly any of the flow remains."""
    return 1.0 + change.mean < _STOPPED


def what_if_answer(stored: Stored) -> list[str]:
    """Simulated flow rates beside the law's, where an input of the law was varied in both."""
    sentences = [
        _beside_the_law(stored, varied, value)
        for varied in (FRACTION, POROSITY)
        for value in sorted(set().union(*(varied.flows(stored, s) for s in SECTIONS)))
    ]
    return sentences or [f"{capital(NOT_RUN)}."]


def _beside_the_law(stored: Stored, varied: Varied, value: float) -> str:
    law_at = varied.estimate(value)
    expected = float(np.asarray(law_at.particle_flow_rate_m3_s))
    outside = "" if law_at.valid else ", where it is said not to hold"
    told = []
    for section in SECTIONS:
        pooled = varied.flows(stored, section).get(value)
        judged = judge(pooled, expected, FLOW_UNIT).words
        told.append(f"{section}, {cell(pooled, FLOW_UNIT)}, {judged}")
    return f"{varied.symbol} = {value:g}, held against the law{outside}: {'; '.join(told)}."
