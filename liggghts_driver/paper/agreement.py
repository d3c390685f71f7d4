"""How the runs meet Table 1: its flow rates and its velocities, counted by how they compare."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Literal

import numpy as np

from liggghts_driver.paper import law
from liggghts_driver.paper.catalogue import TABLE_READINGS
from liggghts_driver.paper.pooled import answers_of, by_gradient, flow, velocity, velocity_range
from liggghts_driver.paper.printed import ROWS, SECTIONS, TABLE_1
from liggghts_driver.paper.speeds import ALL
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
    from collections.abc import Iterable, Iterator

    from liggghts_driver.paper.catalogue import Series
    from liggghts_driver.paper.stored import Answer, Point, Stored
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
Side = Literal[
    "within it", "overlapping it", "below it", "above it", "above it with all counted",
    "one packing",
]  # fmt: skip


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
            "runs are steady over the second half; means with others in them are marked "
            f"{DRIFTS}.{_how_far(stored)}"
        )


def _how_far(stored: Stored) -> str:
    """By how much the flow rates that are not steady change."""
    told = []
    for name in SECTIONS:
        changes = [
            change
            for point in stored.points()
            if point.sound is not None and not second_half(point.sound, name).steady
            if (change := _late_change(point.sound, name)) is not None
        ]
        if changes:
            low, middle, high = (
                number(100.0 * share, 2) for share in np.quantile(changes, (0.25, 0.5, 0.75))
            )
            told.append(f"{middle} % at the {name} (half of them {low} to {high} %)")
    if not told:
        return ""
    return (
        " From the third quarter of the run to the last, the others change in the median by "
        f"{listed(told)}."
    )


def _late_change(answer: Answer, section: str) -> float | None:
    """The relative change of a rate from the third quarter of a run to the last."""
    third, last = answer.curves.quarters()
    before = answer.curves.rate_m3_s(section, third, last)
    return answer.curves.last_quarter_m3_s(section) / before - 1.0 if before > 0.0 else None


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
            if side == "above it" and _all_above(points, ROWS[gradient].velocity_m_s):
                side = "above it with all counted"
            sides.setdefault(side, []).append(f"{gradient:g}")
    return sides


def velocity_words(sides: dict[Side, list[str]]) -> str:
    """The same in words."""
    told = {
        "one packing": "known from one packing alone",
        "above it with all counted": "above it, whatever counts as flowing,",
    }
    return listed([f"{told.get(s, s)} at {listed(some)} Pa/m" for s, some in sides.items()])


def _all_above(points: Iterable[Point], printed: tuple[float, float]) -> bool:
    """Whether even the mean of all inside is above the printed range: then any choice of some is.

    In every packing of which that is known, and in several.
    """
    found = [a.faster_m_s[ALL] for a in answers_of(points).values() if ALL in a.faster_m_s]
    return len(found) > 1 and min(found) > printed[1]


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
