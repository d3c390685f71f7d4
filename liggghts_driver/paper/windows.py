"""The flow rate of one run in a window of time: its own, or computed anew from its stored curve."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.paper.printed import SECTIONS
from liggghts_driver.paper.stored import Measured
from liggghts_driver.physics.spheres import sphere_volume_m3
from liggghts_driver.statistics import flow_rate

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from liggghts_driver.paper.stored import Answer

#: A window that begins as near to the middle of the run, as a share of it, is its second half.
_AS_GOOD_AS_HALF = 0.1
#: A flow whose rate grows by more than this factor from the third quarter of a run to the last is
#: still coming up: its mean over the second half is no lasting rate.
GROWTH = 1.25
#: A window that is short beside the phases of the flow and long beside single arrivals.
WINDOW_S = 2.5
#: Of a particle of the paper's mean radius, 1.5 mm.
PARTICLE_M3 = sphere_volume_m3(1.5e-3)
#: Of so many particles in a window chance seldom lets half or twice come.
_FEWEST_M3 = 25 * PARTICLE_M3
#: Standard deviations of a count that chance seldom exceeds.
_CHANCE = 3.0


def second_half(answer: Answer, section: str) -> Measured:
    """What a run says of the flow past a section in its second half.

    The rate is volume over time of that half. Its error in time, and whether it is steady, are
    those of the run's own window where this is nearly the same: it is of all samples. Where it is
    another, as that of a run in which nothing has come for long, both are computed anew.
    """
    own, half_s = answer.flow_m3_s[section], 0.5 * answer.curves.end_s
    if own.mean is not None and abs(own.from_s / answer.curves.end_s - 0.5) <= _AS_GOOD_AS_HALF:
        return _volume_over_time(own, answer, section, half_s)
    return rate_from(answer, section, half_s)


def _volume_over_time(found: Measured, answer: Answer, section: str, from_s: float) -> Measured:
    """A rate with the mean that passed: the slope of a line is another where the curve bends."""
    curves = answer.curves
    first = curves.sample_at(from_s)
    return replace(found, mean=curves.rate_m3_s(section, first), from_s=first * curves.interval_s)


def rate_from(answer: Answer, section: str, from_s: float) -> Measured:
    """The flow rate from an instant to the end [m3/s], and whether all of that is steady.

    A curve with a standstill in it wanders so much that a drift is not told from noise: so no
    short window may go far from the mean either.
    """
    curves = answer.curves
    first = curves.sample_at(from_s)
    volumes_m3 = 1e-9 * np.array(curves.volume_mm3[section][first:], dtype=np.float64)
    times_s = curves.interval_s * (first + np.arange(len(volumes_m3)))
    found = flow_rate(times_s, volumes_m3, whole=True)
    # In a series that is too short to tell, it is infinite.
    ci95 = found.ci95_m3_s if math.isfinite(found.ci95_m3_s) else None
    measured = Measured(found.mean_m3_s, ci95, found.steady, from_s, found.reason)
    if found.steady and uneven(rates_in_windows([answer], section, from_s)) is not None:
        why = f"in {WINDOW_S:g} s it goes below half or above twice the mean"
        measured = replace(measured, steady=False, reason=why)
    return _volume_over_time(measured, answer, section, from_s)


def steady_since(answer: Answer, section: str, from_s: float) -> bool:
    """Whether a section has been reached by an instant, and its flow is steady from then on."""
    reached_s = answer.reached_s[section]
    if reached_s is None or reached_s > from_s:
        return False
    return rate_from(answer, section, from_s).steady


def rates_in_windows(answers: Iterable[Answer], section: str, from_s: float) -> dict[float, float]:
    """The flow rate in one short window after another [m3/s], by its start; over packings."""
    found: dict[float, list[float]] = {}
    for curves in (answer.curves for answer in answers):
        start, step = curves.sample_at(from_s), curves.sample_at(WINDOW_S)
        samples = len(curves.volume_mm3[section])
        for number, first in enumerate(range(start, samples - step, step)):
            rate = curves.rate_m3_s(section, first, first + step)
            found.setdefault(from_s + number * WINDOW_S, []).append(rate)
    return {time_s: float(np.mean(rates)) for time_s, rates in found.items()}


def uneven(rates: Mapping[float, float]) -> tuple[float, float] | None:
    """When the slowest and the fastest window begin, the first in time first; None if all are even.

    Even is what goes nowhere below half or above twice the mean, and a flow of so few particles
    that chance alone makes it do so.
    """
    mean = sum(rates.values()) / len(rates) if rates else 0.0
    if mean < _FEWEST_M3 / WINDOW_S:
        return None
    slow, fast = min(rates, key=rates.__getitem__), max(rates, key=rates.__getitem__)
    if rates[slow] >= 0.5 * mean and rates[fast] <= 2.0 * mean:
        return None
    return min(slow, fast), max(slow, fast)


def comes_up(answer: Answer, section: str) -> bool:
    """Whether a flow still grows at the end of a run, or is still on its way to a section."""
    curves = answer.curves
    if answer.reached_s[section] is None:
        before = SECTIONS[: SECTIONS.index(section)]
        return any(second_half(answer, name).mean for name in before)
    third, last = curves.quarters()
    earlier = curves.passed_m3(section, third, last) / PARTICLE_M3
    later = curves.passed_m3(section, last) / PARTICLE_M3
    by_chance = _CHANCE * math.sqrt(earlier + later)
    return later > GROWTH * earlier and later - earlier > by_chance
