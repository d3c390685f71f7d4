"""What counts as flowing, which the paper does not say: mean velocities for several choices."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.paper import law
from liggghts_driver.paper.catalogue import TABLE_READINGS
from liggghts_driver.paper.pooled import answers_of, by_gradient, missing
from liggghts_driver.paper.printed import ROWS
from liggghts_driver.paper.speeds import ALL, SHARES
from liggghts_driver.paper.tables import table
from liggghts_driver.paper.words import listed, reach
from liggghts_driver.report.numbers import NONE, number

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from liggghts_driver.paper.catalogue import Series
    from liggghts_driver.paper.stored import Stored

#: The choices, by the names that they have in the stored results.
_CHOICES = (ALL, *(f"{share:g}" for share in SHARES))


def choices_table(stored: Stored) -> str:
    """The mean velocity inside over free flight, for each choice, beside the paper's range."""
    rows = []
    for series in TABLE_READINGS:
        for gradient, points in by_gradient(stored, series).items():
            answers = answers_of(points).values()
            found = [answer.faster_m_s for answer in answers if answer.faster_m_s]
            free = law.free_flight_m_s(gradient)
            means = _means(found, free)
            cells = [number(means[name], 2) if name in means else NONE for name in _CHOICES]
            low, high = (number(v / free, 2) for v in ROWS[gradient].velocity_m_s)
            count = number(len(found)) if answers else missing(points)
            rows.append([series.name, f"{gradient:g}", *cells, f"{low} to {high}", count])
    heads = ["all inside", *(f"above {share:g}" for share in SHARES)]
    return table(["reading", "Pa/m", *heads, "DEM, printed", "packings"], rows)


def choices_answer(stored: Stored) -> str:
    """Whether any choice lets the velocity over free flight rise with the gradient, as printed."""
    low, high = law.slow_gradients()
    printed = _printed(high) / _printed(low)
    told, fall = [], printed > 1.0
    for series in TABLE_READINGS:
        factors = _factors(stored, series, low, high)
        if factors:
            told.append(f"{reach(factors)} in *{series.name}*")
            fall = fall and max(factors) < 1.0
    if not told:
        return ""
    end = ": no choice makes it rise" if fall else ""
    return (
        f"From {low:g} to {high:g} Pa/m the velocity over free flight changes by a factor of "
        f"{number(printed, 2)} in the paper; in ours, for these choices, of {listed(told)}{end}."
    )


def _factors(stored: Stored, series: Series, low: float, high: float) -> list[float]:
    """What becomes of the velocity over free flight between two gradients, for each choice.

    Of the packings that are known at both; none where there is none.
    """
    points = by_gradient(stored, series)
    ends = [answers_of(points.get(gradient, [])) for gradient in (low, high)]
    both = [s for s in ends[0] if s in ends[1] and all(e[s].faster_m_s for e in ends)]
    means = [
        _means([end[seed].faster_m_s for seed in both], law.free_flight_m_s(gradient))
        for end, gradient in zip(ends, (low, high), strict=True)
    ]
    return [means[1][name] / means[0][name] for name in _CHOICES if all(name in m for m in means)]


def _means(found: Sequence[Mapping[str, float]], scale: float) -> dict[str, float]:
    """The mean over packings for each choice that all of them have."""
    shared = [name for name in _CHOICES if found and all(name in each for each in found)]
    return {name: float(np.mean([each[name] for each in found])) / scale for name in shared}


def _printed(gradient_pa_m: float) -> float:
    """The middle of the paper's range over free flight."""
    return float(np.mean(ROWS[gradient_pa_m].velocity_m_s)) / law.free_flight_m_s(gradient_pa_m)
