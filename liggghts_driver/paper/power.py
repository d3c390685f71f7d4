"""Whether the flow goes with the gradient, or with the power that a lone particle's flight has."""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

from liggghts_driver.paper import law
from liggghts_driver.paper.catalogue import FOLLOWS, MAIN, PRINTED, VISCOUS
from liggghts_driver.paper.pooled import exponent, flows_by_gradient, lasting, missing, of_series
from liggghts_driver.paper.printed import SECTIONS
from liggghts_driver.paper.words import by_kind, holds, listed, short_cell
from liggghts_driver.report.numbers import number

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from liggghts_driver.paper.catalogue import Series
    from liggghts_driver.paper.pooled import Pooled
    from liggghts_driver.paper.stored import Stored

#: The power that the law has.
_PROPORTIONAL = 1.0
#: Half of what lies between the powers 1 and 0.74: a narrower interval cannot hold both.
_TELLS_APART = 0.13

PowerKind = Literal["proportional", "other", "not told", "one packing"]


def power_answer(stored: Stored) -> list[str]:
    """Whether the flow goes with the gradient or with free flight's power; what makes it linear."""
    low, high = law.slow_gradients()
    lone = (
        f"Proportional would be the power 1; a lone particle's free flight goes with the power "
        f"{number(free_flight(MAIN), 2)} from {low:g} to {high:g} Pa/m."
    )
    sentences = [lone]
    kinds: dict[str, list[str]] = {"proportional": [], "other": [], "not told": []}
    for series in (MAIN, PRINTED, FOLLOWS, VISCOUS):
        found = {name: power_of(stored, series, name) for name in SECTIONS}
        words = "; ".join(
            f"{name}{_range_of(stored, series, name)}, {_power_words(stored, series, power)}"
            for name, power in found.items()
        )
        sentences.append(f"*{series.name}*, {series.title}: {words}.")
        pooled = found["entrance"]
        if pooled is not None and pooled.between is not None:
            told = f"*{series.name}* (power {short_cell(pooled)})"
            kinds[kind_of_power(pooled)].append(told)
    return [_linear(kinds), *sentences, *_step_by_step(stored)]


def _step_by_step(stored: Stored) -> Iterator[str]:
    """What takes the power towards 1, if each of the two changes is told from chance."""
    several = (MAIN, FOLLOWS, VISCOUS)
    powers = [power_of(stored, series, "entrance") for series in several]
    known = [power for power in powers if power is not None]
    if len(known) < len(several) or not all(a.is_below(b) for a, b in pairwise(known)):
        return
    first, follows, viscous = (short_cell(power) for power in known)
    yield (
        f"A piston that follows is not enough: at the entrance it takes the power from {first} to "
        f"{follows}, and the viscous fluid besides to {viscous}. (That fluid without this piston "
        "was not run, and the powers are of the gradients that each ran at.)"
    )


def power_of(stored: Stored, series: Series, section: str) -> Pooled | None:
    """The power of the gradient with which a reading's flow goes, where the law is said to hold."""
    return exponent(flows_by_gradient(stored, series, section), fitted(series))


def fitted(series: Series) -> Callable[[float], bool]:
    """The gradients over which a reading's exponent is fitted: where the law is said to hold."""
    return partial(law.is_slow, scene=law.fluid_of(series))


def free_flight(series: Series) -> float:
    """The power of the gradient with which a lone particle flies, over the same gradients."""
    chosen = list(filter(fitted(series), law.gradients_of(series)))
    return law.free_flight_exponent(chosen[0], chosen[-1], law.fluid_of(series))


def kind_of_power(pooled: Pooled) -> PowerKind:
    """Whether a flow goes with the gradient; only an interval too narrow to hold 0.74 says so."""
    if pooled.interval is None:
        return "one packing"
    if not holds(pooled, _PROPORTIONAL):
        return "other"
    return "proportional" if pooled.interval < _TELLS_APART else "not told"


def _apart(free: float) -> bool:
    """Whether free flight has another power than the law: not where drag goes with velocity."""
    return abs(free - _PROPORTIONAL) > _TELLS_APART


def _linear(kinds: Mapping[str, Sequence[str]]) -> str:
    if not any(kinds.values()):
        return "What makes it linear is not known: no reading has an exponent with an interval yet."
    told = {
        "proportional": "the flow goes with the gradient in",
        "other": "the flow does not go with the gradient in",
        "not told": "proportional cannot be told from another power in",
    }
    return f"At the entrance {by_kind(told, kinds)}."


def _range_of(stored: Stored, series: Series, section: str) -> str:
    """The gradients over which an exponent was fitted, and why others were not."""
    within = fitted(series)
    flows = {g: p for g, p in flows_by_gradient(stored, series, section).items() if within(g)}
    chosen = list(lasting(flows))
    rising = [g for g, pooled in flows.items() if pooled.rising]
    rest = [g for g in flows if g not in chosen and g not in rising]
    fewer = [g for g in rest if min(flows[g].values.values()) > 0.0]
    parts = [f"{chosen[0]:g} to {chosen[-1]:g} Pa/m"] if len(chosen) > 1 else []
    parts += _at("still coming up at", rising)
    parts += _at("fewer packings at", fewer)
    parts += _at("in some packing nothing at", [g for g in rest if g not in fewer])
    return f" ({', '.join(parts)})" if parts else ""


def _at(words: str, gradients: Sequence[float]) -> list[str]:
    return [f"{words} {listed([f'{g:g}' for g in gradients])} Pa/m"] if gradients else []


def no_power(stored: Stored, series: Series) -> str:
    """Why there is no power: too few gradients with a lasting flow, or no run at all."""
    points = of_series(stored, series)
    return "no power to be fitted" if any(p.sound for p in points) else missing(points)


def _power_words(stored: Stored, series: Series, pooled: Pooled | None) -> str:
    if pooled is None:
        return no_power(stored, series)
    if pooled.between is None:
        return short_cell(pooled)
    free = free_flight(series)
    near = {"1": _PROPORTIONAL}
    if _apart(free):
        near[number(free, 2)] = free
    held = [name for name, value in near.items() if holds(pooled, value)]
    if not held:
        told = f"neither {' nor '.join(near)}" if len(near) > 1 else f"not {next(iter(near))}"
        return f"{short_cell(pooled)}, {told}"
    if len(held) == len(near) > 1:
        return f"{short_cell(pooled)}, which cannot tell {' from '.join(near)}"
    return f"{short_cell(pooled)}, which may be {listed(held)}"
