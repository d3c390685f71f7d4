"""The questions that the paper raises, answered from the stored results: sentences by numbers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from liggghts_driver.paper import law
from liggghts_driver.paper.catalogue import (
    FOLLOWS,
    MAIN,
    PRINTED,
    VISCOUS,
)
from liggghts_driver.paper.pooled import (
    by_gradient,
    exponent,
    flow_from,
    flows_by_gradient,
    has_power,
    rates_from,
    second_half,
)
from liggghts_driver.paper.printed import (
    LARGEST_REYNOLDS,
    MAIN_GRADIENT_PA_M,
    ROWS,
    STEADY_FROM_S,
    TABLE_1,
)
from liggghts_driver.paper.words import (
    NOT_RUN,
    by_kind,
    capital,
    counted,
    holds,
    judge,
    listed,
    short_cell,
)
from liggghts_driver.report.numbers import number

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from liggghts_driver.paper.catalogue import Series
    from liggghts_driver.paper.pooled import Pooled
    from liggghts_driver.paper.stored import Answer, Point, Stored

SECTIONS = ("entrance", "middle")
#: Flow rates are said in millionths of a cubic metre per second.
FLOW_UNIT = 1e-6
#: The reading of the flow's dependence on the gradient that the law allows, and the drag.
_PROPORTIONAL = 1.0
#: Half of what lies between the powers 1 and 0.74: only a narrower interval tells them apart.
_TELLS_APART = 0.13
#: A window that is short beside the phases of the flow and long beside single arrivals.
_WINDOW_S = 2.5


def is_slow(gradient_pa_m: float) -> bool:
    """Whether the law is said to hold at a gradient: Re up to about 10."""
    return law.law_reynolds(gradient_pa_m) <= LARGEST_REYNOLDS


def power_answer(stored: Stored) -> list[str]:
    """Whether the flow goes with the gradient or with its 0.74th power; what makes it linear."""
    low, high = _slow_gradients()
    lone = (
        f"Proportional would be the power 1; a lone particle's free flight goes with the power "
        f"{number(_free_flight(), 2)} from {low:g} to {high:g} Pa/m."
    )
    sentences = [lone]
    kinds: dict[str, list[str]] = {"proportional": [], "other": [], "not told": []}
    for series in (MAIN, PRINTED, FOLLOWS, VISCOUS):
        found = {name: power_of(stored, series, name) for name in SECTIONS}
        words = "; ".join(
            f"{n}{_range_of(stored, series, n)}, {_power_words(found[n])}"
            if len(flows_by_gradient(stored, series, n)) > 1
            else f"{n}, {NOT_RUN}"
            for n in SECTIONS
        )
        sentences.append(f'"{series.name}", {series.title}: {words}.')
        pooled = found["entrance"]
        if pooled is not None and pooled.between is not None:
            told = f'"{series.name}" (power {short_cell(pooled)})'
            kinds[kind_of_power(pooled)].append(told)
    return [_linear(kinds), *sentences]


def _slow_gradients() -> tuple[float, float]:
    """The smallest and the largest gradient of Table 1 at which the law is said to hold [Pa/m]."""
    slow = [row.gradient_pa_m for row in TABLE_1 if is_slow(row.gradient_pa_m)]
    return slow[0], slow[-1]


def _free_flight() -> float:
    """The power of the gradient with which a lone particle's velocity goes between these."""
    return law.free_flight_exponent(*_slow_gradients())


def kind_of_power(pooled: Pooled) -> str:
    """Whether a flow goes with the gradient; only a narrow interval without 0.74 says so."""
    if pooled.between is None:
        return "one packing"
    if not holds(pooled, _PROPORTIONAL):
        return "other"
    narrow = pooled.between < _TELLS_APART
    return "proportional" if narrow and not holds(pooled, _free_flight()) else "not told"


def _linear(kinds: Mapping[str, Sequence[str]]) -> str:
    if not any(kinds.values()):
        return "What makes it linear is not known: no reading has an exponent with an interval yet."
    told = {
        "proportional": "the flow goes with the gradient in the reading",
        "other": "the flow does not go with the gradient in the reading",
        "not told": "proportional cannot be told from free flight's power in the reading",
    }
    return f"At the entrance {by_kind(told, kinds)}."


def fitted(series: Series) -> Callable[[float], bool]:
    """The gradients over which a reading's exponent is fitted: where the law is said to hold."""
    return is_slow if series is not VISCOUS else _everywhere


def _everywhere(_gradient_pa_m: float) -> bool:
    return True


def power_of(stored: Stored, series: Series, section: str) -> Pooled | None:
    """The power of the gradient with which a reading's flow goes, where the law is said to hold."""
    return exponent(flows_by_gradient(stored, series, section), fitted(series))


def _range_of(stored: Stored, series: Series, section: str) -> str:
    """The gradients over which an exponent was fitted, and those at which nothing flows."""
    flows = {
        g: p for g, p in flows_by_gradient(stored, series, section).items() if fitted(series)(g)
    }
    chosen = [g for g, pooled in flows.items() if has_power(pooled)]
    late = [f"{g:g}" for g, pooled in flows.items() if pooled.late]
    still = [f"{g:g}" for g, p in flows.items() if g not in chosen and not p.late]
    parts = [f"{chosen[0]:g} to {chosen[-1]:g} Pa/m"] if len(chosen) > 1 else []
    parts += [f"still arriving at {listed(late)} Pa/m"] if late else []
    parts += [f"in some packing nothing at {listed(still)} Pa/m"] if still else []
    return f" ({', '.join(parts)})" if parts else ""


def _power_words(pooled: Pooled | None) -> str:
    if pooled is None:
        return "no power to be fitted"
    if pooled.between is None:
        return short_cell(pooled)
    free = _free_flight()
    if kind_of_power(pooled) == "not told":
        return f"{short_cell(pooled)}, which cannot tell 1 from {number(free, 2)}"
    both = {"1": _PROPORTIONAL, number(free, 2): free}
    near = [name for name, value in both.items() if holds(pooled, value)]
    told = f"which may be {' or '.join(near)}" if near else f"neither {' nor '.join(both)}"
    return f"{short_cell(pooled)}, {told}"


def steady_answer(stored: Stored) -> list[str]:
    """Whether the flow is steady from 10 s on, as the paper has it."""
    points = [p for p in by_gradient(stored, MAIN).get(MAIN_GRADIENT_PA_M, []) if p.sound]
    if not points:
        return [f"{capital(NOT_RUN)}."]
    sentences = [
        f"{capital(name)}: over the second half of the run the flow is "
        f"{steady_words(points, name)}."
        for name in SECTIONS
    ]
    sentences += [_from_then_on(points, name) for name in SECTIONS]
    return [*sentences, _arrivals(stored)]


def steady_words(points: Sequence[Point], section: str) -> str:
    """In how many packings the flow is steady over the second half, and why not in the others."""
    answers = [p.sound for p in points if p.sound is not None]
    found = [second_half(answer, section) for answer in answers]
    drifts = "; ".join(each.reason for each in found if not each.steady)
    why = f" ({drifts})" if drifts else ""
    steady = steady_count(answers, section)
    return f"steady in {steady} of {counted(len(found), 'packing')}{why}"


def steady_count(answers: Iterable[Answer], section: str) -> int:
    """In how many runs the flow past a section is steady over the second half."""
    return sum(second_half(answer, section).steady for answer in answers)


def _arrivals(stored: Stored) -> str:
    """When the first particle passes the middle, at each gradient."""
    told, early = [], False
    for gradient, points in by_gradient(stored, MAIN).items():
        answers = [p.sound for p in points if p.sound is not None]
        times = [a.reached_s["middle"] for a in answers if a.reached_s["middle"] is not None]
        if times:
            told.append(f"{number(min(times))} s at {gradient:g}")
        elif answers:
            told.append(f"not within the run at {gradient:g}")
        early |= gradient == MAIN_GRADIENT_PA_M and min(times, default=math.inf) < STEADY_FROM_S
    beside = "before" if early else "after"
    return (
        f"The first particle passes the middle, soonest of the packings, after {listed(told)} "
        f"Pa/m; at {MAIN_GRADIENT_PA_M:g} Pa/m that is {beside} the {STEADY_FROM_S:g} s from which "
        "the paper has a steady flow there."
    )


def _from_then_on(points: Sequence[Point], section: str) -> str:
    """The mean from the instant on from which the paper has a steady flow, and what it averages."""
    pooled = flow_from(points, section, STEADY_FROM_S)
    judged = judge(pooled, ROWS[MAIN_GRADIENT_PA_M].flow_m3_s(section), FLOW_UNIT)
    return (
        f"{capital(section)}, from {STEADY_FROM_S:g} s to the end, as the text has it: the mean "
        f"flow rate is {short_cell(pooled, FLOW_UNIT)}, which {judged.words}"
        f"{_averaged(points, section)}."
    )


def _averaged(points: Sequence[Point], section: str) -> str:
    """What a mean hides, if a window of that stretch has less than half or more than twice it."""
    rates = rates_from(points, section, STEADY_FROM_S, _WINDOW_S)
    mean = sum(rates.values()) / len(rates)
    fast, slow = max(rates, key=rates.__getitem__), min(rates, key=rates.__getitem__)
    if rates[slow] > 0.5 * mean and rates[fast] < 2.0 * mean:
        return ""
    ends = [
        f"{number(rates[start] / FLOW_UNIT, 2)} in the {_WINDOW_S:g} s from {start:g} s on"
        for start in sorted((fast, slow))
    ]
    what = "a fast entry, a standstill and the decay" if fast < slow else "a flow that comes up"
    return f"; but that averages {what} ({listed(ends)}): it is no steady flow"
