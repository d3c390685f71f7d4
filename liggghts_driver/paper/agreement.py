"""How the runs meet Table 1: its flow rates and its velocities, counted by how they compare."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from liggghts_driver.paper import law
from liggghts_driver.paper.answers import SECTIONS
from liggghts_driver.paper.catalogue import TABLE_READINGS
from liggghts_driver.paper.pooled import by_gradient, flow, velocity
from liggghts_driver.paper.printed import ROWS, TABLE_1
from liggghts_driver.paper.words import (
    DRIFTS,
    NOT_RUN,
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

#: What becomes of the flow rates of Table 1.
_KINDS = {
    "agrees": "within our interval",
    "differs": "outside",
    "undecided": "not decided",
    "arriving": "where our flow is still arriving",
    "one packing": "known from one packing alone",
    "unknown": "not known yet",
}
#: How a mean velocity lies to a printed range.
_WITHIN, _COMPATIBLE = "in the paper's range", "compatible with it within our interval"
_BELOW, _ABOVE = "below the paper's range", "above the paper's range"
AS_THE_PAPER, NOT_AS_THE_PAPER = (_WITHIN, _COMPATIBLE), (_BELOW, _ABOVE)


def flow_agreement(stored: Stored) -> Iterator[str]:
    """How many flow rates are steady, and how many of Table 1's each outside fluid gives."""
    yield from _steady(stored)
    for reading in TABLE_READINGS:
        points = by_gradient(stored, reading)
        kinds = Counter(
            _kind(flow(points.get(row.gradient_pa_m, []), section), row.flow_m3_s(section))
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


def _kind(pooled: Pooled | None, printed: float) -> str:
    return "arriving" if pooled and pooled.late else judge(pooled, printed).kind


def _steady(stored: Stored) -> Iterator[str]:
    rates = [r for p in stored.points() if p.sound for r in p.sound.flow_m3_s.values()]
    if rates:
        yield (
            f"{sum(rate.steady for rate in rates)} of {counted(len(rates), 'flow rate')} of single "
            f"runs are steady over the second half; means with others in them are marked {DRIFTS}."
        )


def velocity_agreement(stored: Stored) -> Iterator[str]:
    """How our mean velocity, with its interval, lies to the paper's range."""
    for reading in TABLE_READINGS:
        words = velocity_words(velocity_kinds(stored, reading))
        if words:
            yield f"{capital(reading.title)}: the mean velocity is {words}."
        yield from _pushed(stored, reading)


def velocity_kinds(stored: Stored, series: Series) -> dict[str, list[str]]:
    """How the mean velocity lies to the paper's range, each with the gradients where it does so."""
    kinds: dict[str, list[str]] = {}
    for gradient, points in by_gradient(stored, series).items():
        mean = velocity(points)
        if mean is not None and gradient in ROWS:
            kind = _to_range(mean, ROWS[gradient].velocity_m_s)
            kinds.setdefault(kind, []).append(f"{gradient:g}")
    return kinds


def velocity_words(kinds: dict[str, list[str]]) -> str:
    """The same in words."""
    return listed([f"{kind} at {listed(some)} Pa/m" for kind, some in kinds.items()])


def _to_range(mean: Pooled, printed: tuple[float, float]) -> str:
    """Where the interval of a velocity lies beside a printed range; one packing decides nothing."""
    if mean.between is None:
        return "known from one packing alone"
    low, high = mean.mean - mean.between, mean.mean + mean.between
    if printed[0] <= low and high <= printed[1]:
        return _WITHIN
    if high < printed[0]:
        return _BELOW
    return _ABOVE if low > printed[1] else _COMPATIBLE


def _pushed(stored: Stored, reading: Series) -> Iterator[str]:
    """Where particles go as fast among grains as a lone one without any: that takes a push."""
    for gradient, points in by_gradient(stored, reading).items():
        mean, free = velocity(points), law.free_flight_m_s(gradient)
        if mean is not None and mean.packings > 1 and mean.mean > free:
            yield (
                f"At {gradient:g} Pa/m the mean velocity, {short_cell(mean, 1e-3)} mm/s, is not "
                f"below that of free flight, {number(1e3 * free)} mm/s, although grains stand in "
                "the way: something pushes from behind."
            )
