"""What explains the difference from the paper: how densely particles lie, and each reading."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.paper import law
from liggghts_driver.paper.catalogue import MAIN, TABLE_READINGS
from liggghts_driver.paper.changes import sensitivity
from liggghts_driver.paper.pooled import by_gradient, flow, velocity
from liggghts_driver.paper.printed import MAIN_GRADIENT_PA_M, ROWS
from liggghts_driver.physics.spheres import sphere_volume_m3
from liggghts_driver.report.numbers import number

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from liggghts_driver.paper.stored import Answer, Point, Stored


def explain_answer(stored: Stored) -> list[str]:
    """What explains the difference from the paper, as far as the runs tell."""
    return [*_crowding(stored), *sensitivity(stored)]


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
