"""The questions that the paper raises, answered from the stored results: sentences by numbers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from liggghts_driver.paper import law
from liggghts_driver.paper.catalogue import (
    FOLLOWS,
    MAIN,
    PRINTED,
    READINGS,
    VISCOUS,
)
from liggghts_driver.paper.pooled import (
    by_gradient,
    exponent,
    flow,
    flow_from,
    flows_by_gradient,
    of_reading,
    runs_through,
)
from liggghts_driver.paper.printed import (
    LARGEST_REYNOLDS,
    MAIN_GRADIENT_PA_M,
    ROWS,
    STEADY_FROM_S,
    TABLE_1,
)
from liggghts_driver.paper.words import NOT_RUN, capital, cell, counted, judge, listed, short_cell
from liggghts_driver.report.numbers import number

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from liggghts_driver.paper.catalogue import Series
    from liggghts_driver.paper.pooled import Pooled
    from liggghts_driver.paper.stored import Point, Stored

SECTIONS = ("entrance", "middle")
#: Flow rates are said in millionths of a cubic metre per second.
FLOW_UNIT = 1e-6
#: The reading of the flow's dependence on the gradient that the law allows, and the drag.
_PROPORTIONAL = 1.0


def reading_answer(stored: Stored) -> list[str]:
    """Whether any reading gives the paper's flow rates at 10 Pa/m: a verdict, then each."""
    printed = ROWS[MAIN_GRADIENT_PA_M]
    known, missing = [], []
    for reading in READINGS:
        points = of_reading(stored, reading)
        found = {name: flow(points, name) for name in SECTIONS}
        judged = {name: judge(found[name], printed.flow_m3_s(name), FLOW_UNIT) for name in SECTIONS}
        if all(each.kind == "unknown" for each in judged.values()):
            missing.append(reading.title)
        else:
            known.append((reading, found, judged))
    both = [r.title for r, _, judged in known if all(j.agrees for j in judged.values())]
    one = [r.title for r, _, j in known if j["entrance"].agrees and r.title not in both]
    offs = {
        reading.title: sum(abs(_off(found[s], printed.flow_m3_s(s))) for s in SECTIONS)
        for reading, found, _ in known
    }
    nearest = min(offs, key=lambda title: offs[title], default="")
    sentences = [_verdict(both, one, len(known), nearest)]
    sentences += [
        f"{capital(reading.title)}: "
        + "; ".join(
            f"{name}, {cell(found[name], FLOW_UNIT)}: {judged[name].words}" for name in SECTIONS
        )
        + "."
        for reading, found, judged in known
    ]
    if missing:
        sentences.append(f"{capital(NOT_RUN)}: {listed(missing)}.")
    return sentences


def _off(pooled: Pooled | None, reference: float) -> float:
    """How far a mean is from a number, over the number; infinitely where there is no mean."""
    return math.inf if pooled is None else pooled.mean / reference - 1.0


def _verdict(both: Sequence[str], one: Sequence[str], known: int, nearest: str) -> str:
    printed = ROWS[MAIN_GRADIENT_PA_M]
    entrance, middle = (number(printed.flow_m3_s(name) / FLOW_UNIT) for name in SECTIONS)
    if not known:
        return f"{capital(NOT_RUN)}."
    if both:
        return (
            f"Yes: {listed(both)} agrees with {entrance} at the entrance and with {middle} at the "
            "middle."
        )
    if one:
        return (
            f"At the entrance {listed(one)} agrees with {entrance}; at the middle none does with "
            f"{middle}."
        )
    return (
        f"No: of {counted(known, 'reading')} that ran, none agrees with {entrance} at the entrance "
        f"within its interval; nearest over both sections comes: {nearest}."
    )


def is_slow(gradient_pa_m: float) -> bool:
    """Whether the law is said to hold at a gradient: Re up to about 10."""
    return law.law_reynolds(gradient_pa_m) <= LARGEST_REYNOLDS


def power_answer(stored: Stored) -> list[str]:
    """Whether the flow goes with the gradient or with its 0.74th power; what makes it linear."""
    gradients = [row.gradient_pa_m for row in TABLE_1 if is_slow(row.gradient_pa_m)]
    free = law.free_flight_exponent(gradients[0], gradients[-1])
    lone = (
        f"Proportional would be the power 1; a lone particle's free flight goes with the power "
        f"{number(free, 2)} from {gradients[0]:g} to {gradients[-1]:g} Pa/m."
    )
    sentences = [lone]
    linear = []
    for series in (MAIN, PRINTED, FOLLOWS, VISCOUS):
        found = {name: _exponent(stored, series, name) for name in SECTIONS}
        words = "; ".join(
            f"{n}{_range_of(stored, series, n)}, {_power_words(found[n], free)}" for n in SECTIONS
        )
        sentences.append(f'"{series.name}", {series.title}: {words}.')
        pooled = found["entrance"]
        if pooled is not None and _holds(pooled, _PROPORTIONAL):
            linear.append(f'"{series.name}"')
    judged = [s for s in (MAIN, PRINTED, FOLLOWS, VISCOUS) if _known(stored, s)]
    return [_linear(linear, judged), *sentences]


def _linear(linear: Sequence[str], judged: Sequence[Series]) -> str:
    if not judged:
        return "What makes it linear is not known: no reading has an exponent with an interval yet."
    if linear:
        how = listed(linear)
        return f"At the entrance the flow goes with the gradient, within the interval, with {how}."
    names = listed([f'"{series.name}"' for series in judged])
    return (
        "At the entrance the flow goes with the gradient, within the interval, in none of those "
        f"that ran: {names}."
    )


def fitted(series: Series) -> Callable[[float], bool]:
    """The gradients over which a reading's exponent is fitted: where the law is said to hold."""
    return is_slow if series is not VISCOUS else _everywhere


def _everywhere(_gradient_pa_m: float) -> bool:
    return True


def _exponent(stored: Stored, series: Series, section: str) -> Pooled | None:
    return exponent(flows_by_gradient(stored, series, section), fitted(series))


def _known(stored: Stored, series: Series) -> bool:
    pooled = _exponent(stored, series, "entrance")
    return pooled is not None and pooled.between is not None


def _range_of(stored: Stored, series: Series, section: str) -> str:
    """The gradients over which an exponent was fitted, and those at which nothing flows."""
    flows = {
        g: p for g, p in flows_by_gradient(stored, series, section).items() if fitted(series)(g)
    }
    chosen = [g for g, pooled in flows.items() if runs_through(pooled)]
    still = [f"{g:g}" for g in flows if g not in chosen]
    nothing = f", in some packing nothing at {listed(still)} Pa/m" if still else ""
    return f" ({chosen[0]:g} to {chosen[-1]:g} Pa/m{nothing})" if len(chosen) > 1 else ""


def _holds(pooled: Pooled, value: float) -> bool:
    return pooled.between is not None and abs(pooled.mean - value) <= pooled.between


def _power_words(pooled: Pooled | None, free: float) -> str:
    if pooled is None or pooled.between is None:
        return short_cell(pooled)
    both = {"1": _PROPORTIONAL, number(free, 2): free}
    near = [name for name, value in both.items() if _holds(pooled, value)]
    told = f"which may be {' or '.join(near)}" if near else f"neither {' nor '.join(both)}"
    return f"{short_cell(pooled)}, {told}"


def steady_answer(stored: Stored) -> list[str]:
    """Whether the flow is steady from 10 s on, as the paper has it."""
    points = [p for p in by_gradient(stored, MAIN).get(MAIN_GRADIENT_PA_M, []) if p.sound]
    if not points:
        return [f"{capital(NOT_RUN)}."]
    sentences = []
    for name in SECTIONS:
        found = [p.sound.flow_m3_s[name] for p in points if p.sound is not None]
        steady = sum(each.steady for each in found)
        drifts = "; ".join(each.reason for each in found if not each.steady)
        why = f" ({drifts})" if drifts else ""
        sentences.append(
            f"{capital(name)}: over the second half of the run the flow is steady in {steady} of "
            f"{counted(len(found), 'packing')}{why}."
        )
    sentences += [_from_then_on(points, name) for name in SECTIONS]
    return [*sentences, _arrivals(stored)]


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
    pooled = flow_from(points, section, STEADY_FROM_S)
    printed = ROWS[MAIN_GRADIENT_PA_M].flow_m3_s(section)
    return (
        f"{capital(section)}, from {STEADY_FROM_S:g} s to the end, as the text has it: the mean "
        f"flow rate is {short_cell(pooled, FLOW_UNIT)}; the paper's is "
        f"{number(printed / FLOW_UNIT)}."
    )


def validity_answer(stored: Stored, series: Series) -> list[str]:
    """Where the simulated flow leaves the law's line."""
    return [
        f"{capital(name)}: {_leaves(flows_by_gradient(stored, series, name))}." for name in SECTIONS
    ]


def _leaves(flows: dict[float, Pooled]) -> str:
    known = {g: pooled for g, pooled in flows.items() if pooled.half_width is not None}
    if not known:
        return NOT_RUN
    sides: dict[str, list[float]] = {"above": [], "on": [], "below": []}
    for gradient, pooled in known.items():
        off, half = pooled.mean - law.law_flow_m3_s(gradient), pooled.half_width or 0.0
        sides["on" if abs(off) <= half else "above" if off > 0.0 else "below"].append(gradient)
    parts = [
        f"{side} it at {listed([f'{g:g}' for g in some])} Pa/m"
        for side, some in sides.items()
        if some
    ]
    below = sides["below"]
    last = max(sides["above"] + sides["on"], default=None)
    beyond = [g for g in below if last is not None and g > last]
    if not beyond:
        return f"beside the law's line, the flow is {listed(parts)}"
    reynolds = number(law.law_reynolds(beyond[0]), 2)
    return (
        f"beside the law's line, the flow is {listed(parts)}; it stays below from {beyond[0]:g} "
        f"Pa/m on, Re = {reynolds}"
    )
