"""Sentences about measured numbers, chosen by the numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from liggghts_driver.paper.stored import NOT_RUN
from liggghts_driver.report.numbers import decimals_for, fixed, number

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from liggghts_driver.paper.pooled import Pooled

#: Flow rates are said in millionths of a cubic metre per second.
FLOW_UNIT = 1e-6
#: An interval wider than this, over what is compared with, agrees with too much to decide.
WIDEST = 0.25
#: Share of a flow rate by which the settings of the runs may be off, beside the finest ones.
SETTINGS_ERROR = 0.05
#: Set behind a number with a run that drifts, and with one whose flow still comes up.
DRIFTS, RISING = "~", "→"

#: Whether something that the paper says holds.
Verdict = Literal["yes", "no", "in part", "not decided", "not run yet"]
Kind = Literal["agrees", "undecided", "differs", "rising", "one packing", "unknown"]


@dataclass(frozen=True)
class Judgement:
    """Whether a number agrees with a reference within its interval, and how it is said.

    ``side`` is above or below where it differs, and empty otherwise.
    """

    kind: Kind
    words: str
    side: str = ""

    @property
    def agrees(self) -> bool:
        """Whether it does, and is known well enough to say so."""
        return self.kind == "agrees"


def judge(pooled: Pooled | None, reference: float, scale: float = 1.0) -> Judgement:
    """A mean over packings held against a number, by the interval between the packings.

    One packing decides nothing: how much another would differ is not known; nor does a flow that
    still comes up. What the settings may be off is no part of the interval; a difference that this
    can explain is not decided.

    Parameters
    ----------
    pooled
        The mean; None where there is none.
    reference
        What it is held against, in the same unit.
    scale
        The size of the unit in which numbers are said.
    """
    if pooled is None:
        return Judgement("unknown", NOT_RUN)
    other, half = number(reference / scale), pooled.interval
    off = pooled.mean - reference
    side = "above" if off > 0.0 else "below"
    apart = f"is {_percent(off / reference)} {side} {other}"
    if pooled.rising:
        return Judgement("rising", f"{apart}, but still comes up")
    if half is None:
        return Judgement("one packing", f"{apart} in one packing, which decides nothing")
    if abs(off) > half + SETTINGS_ERROR * abs(pooled.mean):
        return Judgement("differs", apart, side)
    if half > WIDEST * abs(reference):
        wide = _percent(half / reference)
        return Judgement("undecided", f"is too uncertain (± {wide}) to compare with {other}")
    if abs(off) > half:
        return Judgement("undecided", f"{apart}, which interval and settings together may explain")
    return Judgement("agrees", f"agrees with {other} within its interval")


def _percent(ratio: float) -> str:
    return f"{number(100.0 * abs(ratio), 2)} %"


def cell(pooled: Pooled | None, scale: float = 1.0, without: str = NOT_RUN) -> str:
    """A mean over packings, its interval between them, its error in time, how many there are.

    ``without`` is what is said where there is none.
    """
    if pooled is None:
        return without
    widths = [w / scale for w in (pooled.between, pooled.in_time) if w is not None]
    decimals = decimals_for(min(widths)) if widths else None
    between, in_time = (
        "?" if width is None else fixed(width / scale, decimals)
        for width in (pooled.between, pooled.in_time)
    )
    mean = fixed(pooled.mean / scale, decimals)
    return f"{mean} ± {between} ± {in_time} ({pooled.packings}){marks(pooled)}"


def holds(pooled: Pooled, value: float) -> bool:
    """Whether a value lies within the interval between packings; with one packing none does."""
    return pooled.interval is not None and abs(pooled.mean - value) <= pooled.interval


def marks(pooled: Pooled) -> str:
    """What is to be known of a number: that a run drifts, that a flow still comes up."""
    drifts = f" {DRIFTS}" if pooled.steady < pooled.packings else ""
    return f"{drifts} {RISING}" if pooled.rising else drifts


def short_cell(pooled: Pooled | None, scale: float = 1.0, without: str = NOT_RUN) -> str:
    """A mean over packings with the interval that it is judged by, and how many they are."""
    if pooled is None:
        return without
    mean = pooled.mean / scale
    if pooled.interval is None:
        return f"{number(mean)} (one packing){marks(pooled)}"
    decimals = decimals_for(pooled.interval / scale)
    half = fixed(pooled.interval / scale, decimals)
    return f"{fixed(mean, decimals)} ± {half} ({pooled.packings}){marks(pooled)}"


def any_of(verdicts: Iterable[Verdict]) -> Verdict:
    """Whether some reading bears a claim out: one is enough, and "no" takes all of them."""
    found = set(verdicts)
    for weightiest in ("yes", "in part"):
        if weightiest in found:
            return weightiest
    return next(iter(found)) if len(found) == 1 else "not decided"


def by_kind(told: Mapping[str, str], kinds: Mapping[str, Sequence[str]]) -> str:
    """What is said of each kind, then what is of that kind; nothing of a kind that is empty."""
    return "; ".join(f"{told[kind]} {listed(some)}" for kind, some in kinds.items() if some)


def listed(items: Sequence[str]) -> str:
    """Items in a sentence: a, b and c."""
    if len(items) < 2:
        return "".join(items)
    return f"{', '.join(items[:-1])} and {items[-1]}"


def reach(values: Sequence[float], digits: int = 2) -> str:
    """From the smallest to the largest; one number where both are the same to so many digits."""
    low, high = number(min(values), digits), number(max(values), digits)
    return low if low == high else f"{low} to {high}"


def counted(count: int, noun: str) -> str:
    """A number with its noun."""
    return f"{number(count)} {noun}" if count == 1 else f"{number(count)} {noun}s"


def capital(sentence: str) -> str:
    """A sentence with a capital letter."""
    return sentence[:1].upper() + sentence[1:]
