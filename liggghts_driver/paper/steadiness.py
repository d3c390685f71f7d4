"""Whether the flow is steady, over the second half of a run and from the paper's 10 s on."""

from __future__ import annotations

from typing import TYPE_CHECKING

from liggghts_driver.paper.catalogue import MAIN, TABLE_READINGS
from liggghts_driver.paper.pooled import answers_of, at_ten, by_gradient, flow_from, missing
from liggghts_driver.paper.printed import MAIN_GRADIENT_PA_M, ROWS, SECTIONS, STEADY_FROM_S
from liggghts_driver.paper.windows import WINDOW_S, rates_in_windows, second_half, uneven
from liggghts_driver.paper.words import (
    FLOW_UNIT,
    capital,
    counted,
    judge,
    listed,
    reach,
    short_cell,
)
from liggghts_driver.report.numbers import number

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from liggghts_driver.paper.stored import Answer, Point, Stored


def steady_answer(stored: Stored) -> list[str]:
    """Whether the flow is steady from 10 s on, as the paper has it."""
    points = at_ten(stored, MAIN)
    if not answers_of(points):
        return [f"{capital(missing(points))}."]
    sentences = [
        f"{capital(name)}: over the second half of the run the flow is "
        f"{steady_words(points, name)}."
        for name in SECTIONS
    ]
    sentences += [_from_then_on(points, name) for name in SECTIONS]
    return [*sentences, *_past_both(stored), _arrivals(stored)]


def steady_words(points: Sequence[Point], section: str) -> str:
    """In how many packings the flow is steady over the second half, and why not in the others."""
    found = [second_half(answer, section) for answer in answers_of(points).values()]
    drifts = [
        f"packing {count}: {_typeset(each.reason)}"
        for count, each in enumerate(found, 1)
        if not each.steady
    ]
    why = f" ({'; '.join(drifts)})" if drifts else ""
    steady = sum(each.steady for each in found)
    return f"steady in {steady} of {counted(len(found), 'packing')}{why}"


def _past_both(stored: Stored) -> Iterator[str]:
    """Whether as much passes the middle as the entrance at the end, as it does in a steady flow."""
    told = []
    for series in TABLE_READINGS:
        curves = [answer.curves for answer in answers_of(at_ten(stored, series)).values()]
        rates = [[each.last_quarter_m3_s(name) for name in SECTIONS] for each in curves]
        ratios = [entrance / middle for entrance, middle in rates if middle > 0.0]
        if ratios:
            told.append(f"{reach(ratios, 3)} times that past the middle in *{series.name}*")
    if told:
        yield (
            "A steady flow is the same past both sections. In the last quarter of the runs that "
            f"past the entrance is {listed(told)}: above 1 the half between them still fills, "
            "below 1 it empties."
        )


def _typeset(reason: str) -> str:
    """Why a flow is not steady, with signs and spaces as everywhere on the page."""
    return reason.removeprefix("drifts: ").replace("-", "−").replace("%", " %")


def _arrivals(stored: Stored) -> str:
    """When the first particle passes the middle, at each gradient."""
    told = [
        f"{first_arrival(answers)} at {gradient:g} Pa/m"
        for gradient, points in by_gradient(stored, MAIN).items()
        if (answers := answers_of(points).values())
    ]
    soonest_s = _soonest_s(answers_of(at_ten(stored, MAIN)).values())
    beside = "before" if soonest_s is not None and soonest_s < STEADY_FROM_S else "after"
    return (
        f"The first particle passes the middle, soonest of the packings, {listed(told)}; at "
        f"{MAIN_GRADIENT_PA_M:g} Pa/m that is {beside} the {STEADY_FROM_S:g} s from which "
        "the paper has a steady flow there."
    )


def first_arrival(answers: Iterable[Answer]) -> str:
    """When the first particle of all packings passes the middle."""
    soonest_s = _soonest_s(answers)
    return "not within the run" if soonest_s is None else f"after {number(soonest_s)} s"


def _soonest_s(answers: Iterable[Answer]) -> float | None:
    times_s = [answer.reached_s["middle"] for answer in answers]
    return min((time_s for time_s in times_s if time_s is not None), default=None)


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
    """What a mean hides, where some short window is far from it."""
    rates = rates_in_windows(answers_of(points).values(), section, STEADY_FROM_S)
    ends = uneven(rates)
    if ends is None:
        return ""
    told = [
        f"{number(rates[start] / FLOW_UNIT, 2)} in the {WINDOW_S:g} s from {start:g} s on"
        for start in ends
    ]
    return f"; but that averages {listed(told)}: it is no steady flow"
