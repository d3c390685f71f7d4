"""Where the simulated flow follows the law's line, leaves it, or crosses it."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Literal

from liggghts_driver.paper import law
from liggghts_driver.paper.answers import SECTIONS, is_slow
from liggghts_driver.paper.pooled import exponent, flows_by_gradient, has_power
from liggghts_driver.paper.words import NOT_RUN, capital, holds, judge, listed, short_cell
from liggghts_driver.report.numbers import number

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from liggghts_driver.paper.catalogue import Series
    from liggghts_driver.paper.pooled import Pooled
    from liggghts_driver.paper.stored import Stored

#: A line is followed where so many neighbouring gradients are on it ...
_FEWEST = 3
#: ... and the power over them is 1 within at most this: it could not be free flight's 0.74 then.
_WIDEST_POWER = 0.15
Course = Literal["followed", "left", "not told"]
#: In the order in which they are told.
_ABOVE, _OPEN, _ON, _BELOW = "above it", "not told from it", "on it", "below it"
_ONE, _LATE = "known from one packing alone", "still arriving"
_SIDES = (_ABOVE, _OPEN, _ON, _BELOW, _ONE, _LATE)
_SIDE_OF = {"agrees": _ON, "undecided": _OPEN, "one packing": _ONE}


def validity_answer(stored: Stored, series: Series) -> list[str]:
    """How the simulated flow goes beside the law's line, past each section."""
    return [
        f"{capital(name)}: {line_words(flows_by_gradient(stored, series, name))}."
        for name in SECTIONS
    ]


def line_words(flows: Mapping[float, Pooled]) -> str:
    """On which side of the line the flow is at each gradient, and what course that makes."""
    if not flows:
        return NOT_RUN
    course = _course(flows, _sides(flows))
    return f"beside the law's line, the flow is {sides_words(flows)}{course}"


def sides_words(flows: Mapping[float, Pooled]) -> str:
    """On which side of the line the flow is at each gradient."""
    sides = _sides(flows)
    parts = [
        f"{side} at {listed([f'{g:g}' for g in some])} Pa/m"
        for side in _SIDES
        if (some := [g for g, found in sides.items() if found == side])
    ]
    return listed(parts)


def follows_the_law(flows: Mapping[float, Pooled]) -> Course:
    """Whether a flow follows the line up to the largest gradient at which it is said to hold."""
    sides = _sides(flows)
    slow = {gradient: side for gradient, side in sides.items() if is_slow(gradient)}
    followed = _followed(flows, sides)
    if followed and followed[-1] >= max(slow):
        return "followed"
    return "left" if {_ABOVE, _BELOW} & set(slow.values()) else "not told"


def _sides(flows: Mapping[float, Pooled]) -> dict[float, str]:
    return {gradient: _side(gradient, pooled) for gradient, pooled in flows.items()}


def _side(gradient_pa_m: float, pooled: Pooled) -> str:
    if pooled.late:
        return _LATE
    judged = judge(pooled, law.law_flow_m3_s(gradient_pa_m))
    return _SIDE_OF.get(judged.kind) or (_ABOVE if judged.side == "above" else _BELOW)


def _course(flows: Mapping[float, Pooled], sides: Mapping[float, str]) -> str:
    """What is to be made of the sides: the line is followed, or crossed, or neither is known."""
    followed = _followed(flows, sides)
    if followed:
        span = f"from {followed[0]:g} to {followed[-1]:g} Pa/m"
        power = short_cell(_power_over(flows, followed))
        told = f"; it follows the line {span} (power of the gradient {power})"
        return told + _left(followed[-1], sides)
    if set(sides.values()) in ({_ABOVE}, {_BELOW}):
        return ""
    return _crossing(sides) + _along(flows)


def _followed(flows: Mapping[float, Pooled], sides: Mapping[float, str]) -> list[float]:
    """The gradients from which to which the line is followed; none where it is not."""
    run = _longest_run(sides)
    power = _power_over(flows, run)
    return run if len(run) >= _FEWEST and power is not None and _is_one(power) else []


def _power_over(flows: Mapping[float, Pooled], some: Sequence[float]) -> Pooled | None:
    return exponent(flows, lambda gradient: gradient in some)


def _longest_run(sides: Mapping[float, str]) -> list[float]:
    """The most neighbouring gradients that are on the line."""
    runs: list[list[float]] = [[]]
    for gradient, side in sides.items():
        if side == _ON:
            runs[-1].append(gradient)
        elif runs[-1]:
            runs.append([])
    return max(runs, key=len)


def _is_one(power: Pooled) -> bool:
    return holds(power, 1.0) and (power.between or 0.0) < _WIDEST_POWER


def _left(last_pa_m: float, sides: Mapping[float, str]) -> str:
    """Where it leaves the line for good, if all beyond the last that is on it is on one side."""
    beyond = {gradient: side for gradient, side in sides.items() if gradient > last_pa_m}
    if set(beyond.values()) not in ({_ABOVE}, {_BELOW}):
        return ""
    first, side = next(iter(beyond.items()))
    return f" and is {side} from {first:g} Pa/m on, Re = {number(law.law_reynolds(first), 2)}"


def _crossing(sides: Mapping[float, str]) -> str:
    decided = [(g, side) for g, side in sides.items() if side in (_ABOVE, _BELOW)]
    changes = [(a, b) for (a, one), (b, other) in pairwise(decided) if one != other]
    places = listed([f"{low:g} and {high:g} Pa/m" for low, high in changes])
    return f"; it crosses the line between {places}" if changes else ""


def _along(flows: Mapping[float, Pooled]) -> str:
    """Whether a flow that follows the line nowhere that is told goes with its power at all."""
    power, lasting = exponent(flows), [g for g, pooled in flows.items() if has_power(pooled)]
    if power is None or power.between is None:
        return ""
    span = f"from {lasting[0]:g} to {lasting[-1]:g} Pa/m"
    fitted = f"power of the gradient {span} {short_cell(power)}, the law's is 1"
    if holds(power, 1.0):
        return f"; whether it runs along the line anywhere is not known ({fitted})"
    return f"; it runs along the line nowhere ({fitted})"
