"""Where the simulated flow follows the law's line, leaves it, or crosses it."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Literal

from liggghts_driver.paper import law
from liggghts_driver.paper.pooled import exponent, flows_by_gradient, lasting
from liggghts_driver.paper.power import kind_of_power
from liggghts_driver.paper.printed import SECTIONS
from liggghts_driver.paper.stored import NOT_RUN
from liggghts_driver.paper.words import capital, judge, listed, short_cell
from liggghts_driver.report.numbers import number

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from liggghts_driver.paper.catalogue import Series
    from liggghts_driver.paper.pooled import Pooled
    from liggghts_driver.paper.stored import Stored

#: A line is followed where so many neighbouring gradients are on it, and the power over them is 1.
_FEWEST = 3
#: What may be said of a flow beside the law's line, in the order in which it is told.
_ABOVE, _OPEN, _ON, _BELOW = "above it", "not told from it", "on it", "below it"
_ONE, _RISES = "known from one packing alone", "still coming up"
_SIDES = (_ABOVE, _OPEN, _ON, _BELOW, _ONE, _RISES)
_SIDE_OF = {"agrees": _ON, "undecided": _OPEN, "one packing": _ONE, "rising": _RISES}

#: Whether a flow follows the law as far as this is said to hold, and leaves it beyond.
Course = Literal["followed", "farther", "left", "not told"]


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


def course_of(flows: Mapping[float, Pooled]) -> Course:
    """Whether a flow follows the line as far as it is said to, and no farther."""
    sides = _sides(flows)
    slow = {gradient: side for gradient, side in sides.items() if law.is_slow(gradient)}
    if {_ABOVE, _BELOW} & set(slow.values()):
        return "left"
    followed = _followed(flows, sides)
    if not followed or not set(law.slow_gradients()) <= set(followed):
        return "not told"
    return "farther" if followed[-1] > max(slow) else "followed"


def _sides(flows: Mapping[float, Pooled]) -> dict[float, str]:
    return {gradient: _side(gradient, pooled) for gradient, pooled in flows.items()}


def _side(gradient_pa_m: float, pooled: Pooled) -> str:
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
    """The gradients over which the line is followed; none where it is not."""
    run = _longest_run(sides)
    power = _power_over(flows, run)
    if len(run) < _FEWEST or power is None:
        return []
    return run if kind_of_power(power) == "proportional" else []


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
    told = f"; it crosses the line between {places}, which is a crossing and no agreement"
    return told if changes else ""


def _along(flows: Mapping[float, Pooled]) -> str:
    """With which power of the gradient a flow goes that follows the line nowhere that is told."""
    power, chosen = exponent(flows), list(lasting(flows))
    if power is None or power.between is None:
        return ""
    span = f"from {chosen[0]:g} to {chosen[-1]:g} Pa/m"
    return f"; {span} it goes with the gradient to the power {short_cell(power)}, the law with 1"
