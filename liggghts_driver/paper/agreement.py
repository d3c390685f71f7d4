"""How the runs meet Table 1: its flow rates and its velocities, counted by how they compare."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Literal

from liggghts_driver.paper import law
from liggghts_driver.paper.catalogue import TABLE_READINGS
from liggghts_driver.paper.pooled import by_gradient, flow, velocity
from liggghts_driver.paper.printed import ROWS, SECTIONS, TABLE_1
from liggghts_driver.paper.stored import NOT_RUN
from liggghts_driver.paper.windows import second_half
from liggghts_driver.paper.words import (
    DRIFTS,
    SETTINGS_ERROR,
    capital,
    counted,
    judge,
    listed,
    short_cell,
)
from liggghts_driver.report.numbers import number

if TYPE_CHECKING:
    from collections.abc import Iterator

    from liggghts_driver.paper.catalogue import Series
    from liggghts_driver.paper.pooled import Pooled
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
#: How a mean velocity lies to a printed range.
Side = Literal["in the range", "below it", "above it", "not told from it", "one packing"]


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
            yield f"{capital(reading.title)}: {NOT_RUN}."
            continue
        parts = [f"{kinds[kind]} {words}" for kind, words in _KINDS.items() if kinds[kind]]
        yield (
            f"{capital(reading.title)}: of {kinds.total()} simulated flow rates of Table 1, "
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
    """How our mean velocity, with its interval, lies to the paper's range."""
    for reading in TABLE_READINGS:
        words = velocity_words(velocity_sides(stored, reading))
        if words:
            start = f"{capital(reading.title)}: beside the paper's range, the mean velocity is"
            yield f"{start} {words}."
        yield from _pushed(stored, reading)


def velocity_sides(stored: Stored, series: Series) -> dict[Side, list[str]]:
    """How the mean velocity lies to the paper's range, each with the gradients where it does so."""
    sides: dict[Side, list[str]] = {}
    for gradient, points in by_gradient(stored, series).items():
        mean = velocity(points)
        if mean is not None and gradient in ROWS:
            side = _beside(mean, ROWS[gradient].velocity_m_s)
            sides.setdefault(side, []).append(f"{gradient:g}")
    return sides


def velocity_words(sides: dict[Side, list[str]]) -> str:
    """The same in words."""
    told = {"one packing": "known from one packing alone"}
    return listed([f"{told.get(s, s)} at {listed(some)} Pa/m" for s, some in sides.items()])


def _beside(mean: Pooled, printed: tuple[float, float]) -> Side:
    """Where the interval of a velocity lies beside a printed range; one packing decides nothing.

    What the settings may be off can explain a difference, as for flow rates.
    """
    half = mean.interval
    if half is None:
        return "one packing"
    low, high = mean.mean - half, mean.mean + half
    if printed[0] <= low and high <= printed[1]:
        return "in the range"
    off = SETTINGS_ERROR * mean.mean
    if high + off < printed[0]:
        return "below it"
    return "above it" if low - off > printed[1] else "not told from it"


def _pushed(stored: Stored, reading: Series) -> Iterator[str]:
    """Where particles go faster among grains than a lone one without any: that takes a push."""
    for gradient, points in by_gradient(stored, reading).items():
        mean, free = velocity(points), law.free_flight_m_s(gradient)
        if mean is not None and mean.interval is not None and mean.mean - mean.interval > free:
            yield (
                f"{capital(reading.title)}: at {gradient:g} Pa/m the mean velocity, "
                f"{short_cell(mean, 1e-3)} mm/s, is above that of free flight, "
                f"{number(1e3 * free)} mm/s, although grains stand in the way: something pushes "
                "from behind. (It is that of the flowing particles; those that are held do not "
                "count.)"
            )
