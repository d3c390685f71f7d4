"""Packings taken together: the spread between them, and apart from it the error in time of each."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.paper.catalogue import GRADIENT
from liggghts_driver.paper.printed import MAIN_GRADIENT_PA_M
from liggghts_driver.paper.stored import NOT_RUN
from liggghts_driver.paper.windows import comes_up, rate_from, second_half
from liggghts_driver.statistics import students_half_width

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence
    from typing import Any

    from numpy.typing import NDArray

    from liggghts_driver.paper.catalogue import Reading, Series
    from liggghts_driver.paper.stored import Answer, Measured, Point, Stored


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
    rising
        In how many of them the flow still comes up at the end of the run: no lasting flow yet.
    """

    mean: float
    between: float | None
    in_time: float | None
    values: Mapping[int, float]
    steady: int
    rising: int = 0

    @property
    def packings(self) -> int:
        """How many there are."""
        return len(self.values)

    @property
    def interval(self) -> float | None:
        """What the mean is judged by: the interval between packings, no less than time allows.

        A few packings may be alike by chance; None for one packing.
        """
        if self.between is None:
            return None
        return max(self.between, (self.in_time or 0.0) / math.sqrt(self.packings))

    def is_below(self, other: Pooled) -> bool:
        """Whether it is smaller, and neither interval reaches the other."""
        if self.interval is None or other.interval is None:
            return False
        return self.mean + self.interval < other.mean - other.interval

    @property
    def half_width(self) -> float | None:
        """What a bar shows: what the mean is judged by, of one packing the error in its time."""
        return self.in_time if self.between is None else self.interval


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


def answers_of(points: Iterable[Point]) -> dict[int, Answer]:
    """The answers of the runs that no check speaks against, by their seed."""
    return {p.seed: p.sound for p in points if p.sound is not None}


def flow(points: Iterable[Point], section: str) -> Pooled | None:
    """The flow rate past a section [m3/s] over the second half of the runs.

    Runs that a check speaks against do not enter.
    """
    answers = answers_of(points)
    pooled = pool({seed: second_half(found, section) for seed, found in answers.items()})
    rising = sum(comes_up(found, section) for found in answers.values())
    return None if pooled is None else replace(pooled, rising=rising)


def flow_from(points: Iterable[Point], section: str, from_s: float) -> Pooled | None:
    """The flow rate from an instant to the end [m3/s], from the stored curves."""
    answers = answers_of(points)
    return pool({seed: rate_from(found, section, from_s) for seed, found in answers.items()})


def velocity(points: Iterable[Point]) -> Pooled | None:
    """The mean velocity of the flowing particles [m/s]."""
    return pool({seed: found.velocity_m_s for seed, found in answers_of(points).items()})


def velocity_range(points: Iterable[Point]) -> tuple[float, float] | None:
    """Its smallest and largest value [m/s] over the second halves of all packings."""
    ranges = [found.velocity_range_m_s for found in answers_of(points).values()]
    known = [each for each in ranges if each is not None]
    return (min(low for low, _ in known), max(high for _, high in known)) if known else None


def missing(points: Iterable[Point]) -> str:
    """Why there is no number of some points, in a word or two."""
    states = [(p.state, p.sound is not None) for p in points]
    if any(state == "unfinished" for state, _ in states) or not states:
        return NOT_RUN
    return "nothing flows" if any(sound for _, sound in states) else "no valid run"


def by_gradient(stored: Stored, series: Series) -> dict[float, list[Point]]:
    """The points of a reading by gradient, the smallest first; those without an answer too."""
    found: dict[float, list[Point]] = {}
    for name, gradients in series.parts.items():
        for point in stored.points(name):
            gradient = float(point.values[GRADIENT])
            if not gradients or gradient in gradients:
                found.setdefault(gradient, []).append(point)
    return dict(sorted(found.items()))


def at_ten(stored: Stored, series: Series) -> list[Point]:
    """The points of a reading at the paper's main gradient."""
    return by_gradient(stored, series).get(MAIN_GRADIENT_PA_M, [])


def of_series(stored: Stored, series: Series) -> list[Point]:
    """The points of a reading at all its gradients."""
    return [p for points in by_gradient(stored, series).values() for p in points]


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
        Which gradients enter the fit, of those that may (`lasting`).

    Returns
    -------
    Pooled or None
        Over the packings, steady if all that entered is; None where none of them has two gradients.
    """
    chosen = lasting({g: pooled for g, pooled in flows.items() if within(g)})
    seeds = sorted({seed for pooled in chosen.values() for seed in pooled.values})
    whole = [s for s in seeds if all(s in pooled.values for pooled in chosen.values())]
    if len(chosen) < 2 or not whole:
        return None
    weights, several = _slope_weights(list(chosen)), list(chosen.values())
    slopes = {s: float(weights @ np.log([p.values[s] for p in several])) for s in whole}
    mean = float(np.mean(list(slopes.values())))
    steady = all(pooled.steady == pooled.packings for pooled in several)
    between = students_half_width(list(slopes.values()))
    return Pooled(
        mean, between, _power_in_time(weights, several), slopes, len(slopes) if steady else 0
    )


def _slope_weights(gradients: Sequence[float]) -> NDArray[np.float64]:
    """By which the logarithms of flow rates sum up to the slope of least squares."""
    logs = np.log(gradients) - np.mean(np.log(gradients))
    weights: NDArray[np.float64] = logs / np.sum(logs**2)
    return weights


def _power_in_time(weights: NDArray[np.float64], several: Sequence[Pooled]) -> float | None:
    """The error in time of a power, from those of the flow rates, which are independent."""
    known = [p.in_time / p.mean for p in several if p.in_time is not None]
    if len(known) < len(several):
        return None
    return float(np.sqrt(np.sum((weights * known) ** 2)))


def lasting(flows: Mapping[float, Pooled]) -> dict[float, Pooled]:
    """Flow rates that may enter one power of the gradient together.

    Each lasts in all of its packings, and has as many packings as any of them, if there are two
    such: a gradient at which a packing is missing would else take this one from all the others.
    """
    known = {g: pooled for g, pooled in flows.items() if has_power(pooled)}
    most = max((pooled.packings for pooled in known.values()), default=0)
    full = {g: pooled for g, pooled in known.items() if pooled.packings == most}
    return full if len(full) > 1 else known


def has_power(pooled: Pooled) -> bool:
    """Whether it may enter a power of the gradient: a lasting flow, in each of the packings."""
    return not pooled.rising and min(pooled.values.values()) > 0.0


def local_exponents(flows: Mapping[float, Pooled]) -> dict[tuple[float, float], Pooled]:
    """The same between each two neighbouring gradients."""
    gradients = list(flows)
    found = {}
    for low, high in pairwise(gradients):
        pair = exponent({low: flows[low], high: flows[high]})
        if pair is not None:
            found[low, high] = pair
    return found
