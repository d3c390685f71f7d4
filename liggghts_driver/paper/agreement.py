"""How the runs meet Table 1: its flow rates and its velocities, counted by how they compare."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Literal

from liggghts_driver.paper import law
from liggghts_driver.paper.catalogue import TABLE_READINGS
from liggghts_driver.paper.pooled import answers_of, by_gradient, flow, velocity, velocity_range
from liggghts_driver.paper.printed import ROWS, SECTIONS, TABLE_1
from liggghts_driver.paper.stored import NOT_RUN
from liggghts_driver.paper.windows import second_half
from liggghts_driver.paper.words import (
    DRIFTS,
    counted,
    judge,
    listed,
    short_cell,
)
from liggghts_driver.report.numbers import number

if TYPE_CHECKING:
    from collections.abc import Iterator

    from liggghts_driver.paper.catalogue import Series
    from liggghts_driver.paper.stored import Stored
    from liggghts_driver.paper.words import Kind

#: What becomes of the flow rates of Table 1.
_KINDS: dict[Kind, str] = {
    "agrees": "within our interval",
    "differs": "outside",
    "undecided": "not decided",
    "rising": "where our flow still comes up",
    "one packing": "known from one packing alone",
    "unknown": "not known yet",
}
#: How the range of our mean velocity in time lies to the printed one, which is in time as well.
Side = Literal["within it", "overlapping it", "below it", "above it", "one packing"]


def flow_agreement(stored: Stored) -> Iterator[str]:
    """How many flow rates are steady, and how many of Table 1's each outside fluid gives."""
    yield from _steady(stored)
    for reading in TABLE_READINGS:
        points = by_gradient(stored, reading)
        kinds = Counter(
            judge(flow(points.get(row.gradient_pa_m, []), section), row.flow_m3_s(section)).kind
            for row in TABLE_1
            for section in SECTIONS
        )
        if kinds["unknown"] == kinds.total():
            yield f"*{reading.name}*: {NOT_RUN}."
            continue
        parts = [f"{kinds[kind]} {words}" for kind, words in _KINDS.items() if kinds[kind]]
        yield (
            f"*{reading.name}*: of {kinds.total()} simulated flow rates of Table 1, "
            f"{listed(parts)}."
        )


def _steady(stored: Stored) -> Iterator[str]:
    rates = [second_half(p.sound, name) for p in stored.points() if p.sound for name in SECTIONS]
    if rates:
        yield (
            f"{sum(rate.steady for rate in rates)} of {counted(len(rates), 'flow rate')} of single "
            f"runs are steady over the second half; means with others in them are marked {DRIFTS}."
        )


def velocity_agreement(stored: Stored) -> Iterator[str]:
    """How our mean velocity lies to the paper's range."""
    for reading in TABLE_READINGS:
        words = velocity_words(velocity_sides(stored, reading))
        if words:
            yield f"*{reading.name}*: beside the paper's range, ours is {words}."
        yield from _pushed(stored, reading)


def velocity_sides(stored: Stored, series: Series) -> dict[Side, list[str]]:
    """How the mean velocity lies to the paper's range, each with the gradients where it does so."""
    sides: dict[Side, list[str]] = {}
    for gradient, points in by_gradient(stored, series).items():
        reach = velocity_range(points)
        if reach is not None and gradient in ROWS:
            several = len(answers_of(points)) > 1
            side = _beside(reach, ROWS[gradient].velocity_m_s) if several else "one packing"
            sides.setdefault(side, []).append(f"{gradient:g}")
    return sides


def velocity_words(sides: dict[Side, list[str]]) -> str:
    """The same in words."""
    told = {"one packing": "known from one packing alone"}
    return listed([f"{told.get(s, s)} at {listed(some)} Pa/m" for s, some in sides.items()])


def _beside(ours: tuple[float, float], printed: tuple[float, float]) -> Side:
    """Where a range lies beside another, both from the smallest to the largest value in time."""
    if ours[1] < printed[0]:
        return "below it"
    if ours[0] > printed[1]:
        return "above it"
    within = printed[0] <= ours[0] and ours[1] <= printed[1]
    return "within it" if within else "overlapping it"


def _pushed(stored: Stored, reading: Series) -> Iterator[str]:
    """Where particles go faster among grains than a lone one without any: that takes a push."""
    for gradient, points in by_gradient(stored, reading).items():
        mean, free = velocity(points), law.free_flight_m_s(gradient)
        if mean is not None and mean.interval is not None and mean.mean - mean.interval > free:
            yield (
                f"*{reading.name}*: at {gradient:g} Pa/m the mean velocity, "
                f"{short_cell(mean, 1e-3)} mm/s, is above that of free flight, "
                f"{number(1e3 * free)} mm/s, although grains stand in the way: something pushes "
                "from behind. (It is that of the flowing particles; those that are held do not "
                "count.)"
            )
