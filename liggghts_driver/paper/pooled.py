"""Packings taken together: the spread between them, and apart from it the error in time of each."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.paper.catalogue import GRADIENT
from liggghts_driver.paper.stored import Measured
from liggghts_driver.statistics import students_half_width

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from typing import Any

    from liggghts_driver.paper.catalogue import Reading, Series
    from liggghts_driver.paper.stored import Point, Stored


@dataclass(frozen=True)
class Pooled:
    """A quantity over several packings.

    Attributes
    ----------
    mean
        Over the packings.
    between
        Half width of its 95 % interval by Student's t over the packings; None for one packing.
    in_time
        Root mean square of the half widths that the runs themselves give; None where not known.
    values
        Of each packing, by its seed.
    steady
        In how many of them it was steady.
    """

    mean: float
    between: float | None
    in_time: float | None
    values: Mapping[int, float]
    steady: int

    @property
    def packings(self) -> int:
        """How many there are."""
        return len(self.values)

    @property
    def half_width(self) -> float | None:
        """What a comparison goes by: the packings' interval, of one packing that of its time."""
        return self.in_time if self.between is None else self.between


def pool(found: Mapping[int, Measured]) -> Pooled | None:
    """What the runs of some packings measured, together; None without any mean."""
    known = {seed: each for seed, each in found.items() if each.mean is not None}
    if not known:
        return None
    values = {seed: each.mean for seed, each in known.items() if each.mean is not None}
    own = [each.ci95 for each in known.values() if each.ci95 is not None]
    return Pooled(
        mean=float(np.mean(list(values.values()))),
        between=students_half_width(list(values.values())),
        in_time=math.sqrt(float(np.mean(np.square(own)))) if len(own) == len(known) else None,
        values=values,
        steady=sum(each.steady for each in known.values()),
    )


def flow(points: Iterable[Point], section: str) -> Pooled | None:
    """The flow rate past a section [m3/s]; runs that a check speaks against do not enter."""
    return pool({p.seed: p.sound.flow_m3_s[section] for p in points if p.sound is not None})


def flow_from(points: Iterable[Point], section: str, from_s: float) -> Pooled | None:
    """The mean flow rate from an instant to the end [m3/s], from the stored curves."""
    found = {}
    for point in points:
        if point.sound is not None:
            curves = point.sound.curves
            volumes = curves.volume_mm3[section]
            start = math.ceil(from_s / curves.interval_s - 1e-9)
            time_s = (len(volumes) - 1 - start) * curves.interval_s
            rate = 1e-9 * (volumes[-1] - volumes[start]) / time_s
            found[point.seed] = Measured(rate, None, steady=False, from_s=from_s, reason="")
    return pool(found)


def velocity(points: Iterable[Point]) -> Pooled | None:
    """The mean velocity of the flowing particles [m/s]."""
    return pool({p.seed: p.sound.velocity_m_s for p in points if p.sound is not None})


def velocity_range(points: Iterable[Point]) -> tuple[float, float] | None:
    """Its smallest and largest value [m/s] over the second halves of all packings."""
    ranges = [p.sound.velocity_range_m_s for p in points if p.sound is not None]
    known = [each for each in ranges if each is not None]
    return (min(low for low, _ in known), max(high for _, high in known)) if known else None


def seconds_per_second(points: Iterable[Point]) -> list[float]:
    """Processor time for a simulated second of each run whose time is known."""
    costs = [point.answer.cost for point in points if point.answer is not None]
    return [cost["cpu_s"] / cost["simulated_s"] for cost in costs if cost["cpu_s"]]


def by_gradient(stored: Stored, series: Series) -> dict[float, list[Point]]:
    """The points of a reading by gradient, the smallest first; those without an answer too."""
    found: dict[float, list[Point]] = {}
    for name, gradients in series.parts.items():
        for point in stored.points(name):
            gradient = float(point.values[GRADIENT])
            if not gradients or gradient in gradients:
                found.setdefault(gradient, []).append(point)
    return dict(sorted(found.items()))


def of_reading(stored: Stored, reading: Reading) -> list[Point]:
    """The points of a reading."""
    return [p for p in stored.points(reading.sweep) if _has(p.values, reading.values)]


def _has(values: Mapping[str, Any], wanted: Mapping[str, Any]) -> bool:
    return all(values.get(key) == value for key, value in wanted.items())


def flows_by_gradient(stored: Stored, series: Series, section: str) -> dict[float, Pooled]:
    """The flow rate at each gradient that has an answer [m3/s]."""
    found = {g: flow(points, section) for g, points in by_gradient(stored, series).items()}
    return {gradient: pooled for gradient, pooled in found.items() if pooled is not None}


def exponent(
    flows: Mapping[float, Pooled], within: Callable[[float], bool] = lambda _gradient: True
) -> Pooled | None:
    """The power of the gradient with which a flow rate goes, fitted in each packing.

    Parameters
    ----------
    flows
        By gradient.
    within
        Which gradients enter the fit; a packing enters that has all of those that any has.

    Returns
    -------
    Pooled or None
        Over the packings; None where none of them has two gradients at which anything flows.
    """
    chosen = {g: pooled.values for g, pooled in flows.items() if within(g) and runs_through(pooled)}
    seeds = {seed for values in chosen.values() for seed in values}
    whole = [seed for seed in sorted(seeds) if all(seed in values for values in chosen.values())]
    if len(chosen) < 2 or not whole:
        return None
    logs = np.log(list(chosen))
    slopes = {
        seed: float(np.polyfit(logs, np.log([v[seed] for v in chosen.values()]), 1)[0])
        for seed in whole
    }
    mean = float(np.mean(list(slopes.values())))
    return Pooled(mean, students_half_width(list(slopes.values())), None, slopes, len(slopes))


def runs_through(pooled: Pooled) -> bool:
    """Whether something flows in each of the packings: what does not has no logarithm."""
    return min(pooled.values.values()) > 0.0


def local_exponents(flows: Mapping[float, Pooled]) -> dict[tuple[float, float], Pooled]:
    """The same between each two neighbouring gradients."""
    gradients = list(flows)
    found = {}
    for low, high in pairwise(gradients):
        pair = exponent({low: flows[low], high: flows[high]})
        if pair is not None:
            found[low, high] = pair
    return found
