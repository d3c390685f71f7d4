"""Packings taken together: the spread between them, and apart from it the error in time of each."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.paper.catalogue import GRADIENT
from liggghts_driver.paper.stored import Measured
from liggghts_driver.statistics import fit_shape, students_half_width

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from typing import Any

    from liggghts_driver.paper.catalogue import Reading, Series
    from liggghts_driver.paper.stored import Answer, Point, Stored

#: A window that begins as near to the middle of the run, as a share of it, is its second half.
_AS_GOOD_AS_HALF = 0.1
#: A section that the first particle passes later, as a share of the run, is still being reached:
#: over the second half such a flow was seen to grow by 85 % and more.
LATE = 0.4


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
    late
        In how many of them the first particle came so late that it is no lasting flow yet.
    """

    mean: float
    between: float | None
    in_time: float | None
    values: Mapping[int, float]
    steady: int
    late: int = 0

    @property
    def packings(self) -> int:
        """How many there are."""
        return len(self.values)

    @property
    def half_width(self) -> float | None:
        """What a bar shows: the packings' interval, of one packing that of its time."""
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
    """The flow rate past a section [m3/s] over the second half of the runs.

    Runs that a check speaks against do not enter.
    """
    sound = {p.seed: p.sound for p in points if p.sound is not None}
    pooled = pool({seed: second_half(found, section) for seed, found in sound.items()})
    late = sum(_comes_late(found, section) for found in sound.values())
    return None if pooled is None else replace(pooled, late=late)


def second_half(answer: Answer, section: str) -> Measured:
    """What a run says of the flow past a section in its second half.

    The run's own window is the steady part, or what comes closest. That may be the whole run where
    nothing has come for long; then the rate is computed anew, from the stored curve.
    """
    own, curves = answer.flow_m3_s[section], answer.curves
    if not own.mean or abs(own.from_s / curves.end_s - 0.5) <= _AS_GOOD_AS_HALF:
        return own
    volumes = 1e-9 * np.array(curves.volume_mm3[section], dtype=np.float64)
    middle = len(volumes) // 2
    half, from_s = volumes[middle:], middle * curves.interval_s
    rise = fit_shape(half, np.linspace(0.0, 1.0, len(half)))
    return replace(
        own,
        mean=curves.rate_m3_s(section, middle),
        ci95=rise.half_width / (curves.end_s - from_s),
        from_s=from_s,
    )


def _comes_late(answer: Answer, section: str) -> bool:
    """Whether the first particle passed a section late in the run."""
    reached_s = answer.reached_s[section]
    return reached_s is not None and reached_s > LATE * answer.curves.end_s


def flow_from(points: Iterable[Point], section: str, from_s: float) -> Pooled | None:
    """The mean flow rate from an instant to the end [m3/s], from the stored curves."""
    found = {}
    for point in points:
        if point.sound is not None:
            curves = point.sound.curves
            rate = curves.rate_m3_s(section, math.ceil(from_s / curves.interval_s - 1e-9))
            found[point.seed] = Measured(rate, None, steady=False, from_s=from_s, reason="")
    return pool(found)


def rates_from(
    points: Iterable[Point], section: str, from_s: float, window_s: float
) -> dict[float, float]:
    """The flow rate in one window after another [m3/s], by the window's start; over packings."""
    found: dict[float, list[float]] = {}
    for curves in (p.sound.curves for p in points if p.sound is not None):
        start, step = (round(time_s / curves.interval_s) for time_s in (from_s, window_s))
        samples = len(curves.volume_mm3[section])
        for number, first in enumerate(range(start, samples - step, step)):
            rate = curves.rate_m3_s(section, first, first + step)
            found.setdefault(from_s + number * window_s, []).append(rate)
    return {time_s: float(np.mean(rates)) for time_s, rates in found.items()}


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


def seconds_per_step(points: Iterable[Point]) -> list[float]:
    """Processor time for a step of each run whose time is known."""
    costs = [point.answer.cost for point in points if point.answer is not None]
    return [c["cpu_s"] / c["simulated_s"] * c["step_s"] for c in costs if c["cpu_s"]]


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
        Which gradients enter the fit, of those that have a lasting flow; a packing enters that has
        all of those that any has.

    Returns
    -------
    Pooled or None
        Over the packings, steady if all that entered is; None where none of them has two gradients
        with a lasting flow.
    """
    chosen = {g: pooled.values for g, pooled in flows.items() if within(g) and has_power(pooled)}
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
    steady = all(flows[g].steady == flows[g].packings for g in chosen)
    half = students_half_width(list(slopes.values()))
    return Pooled(mean, half, None, slopes, len(slopes) if steady else 0)


def has_power(pooled: Pooled) -> bool:
    """Whether it may enter a power of the gradient: a lasting flow, in each of the packings."""
    return not pooled.late and min(pooled.values.values()) > 0.0


def local_exponents(flows: Mapping[float, Pooled]) -> dict[tuple[float, float], Pooled]:
    """The same between each two neighbouring gradients."""
    gradients = list(flows)
    found = {}
    for low, high in pairwise(gradients):
        pair = exponent({low: flows[low], high: flows[high]})
        if pair is not None:
            found[low, high] = pair
    return found
