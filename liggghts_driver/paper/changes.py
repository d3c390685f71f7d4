"""What a reading changes of a flow rate, seed by seed, from the reading that it differs from."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from liggghts_driver.paper.catalogue import FIRST, READINGS
from liggghts_driver.paper.pooled import flow, of_reading
from liggghts_driver.paper.printed import SECTIONS
from liggghts_driver.paper.stored import NOT_RUN
from liggghts_driver.paper.words import by_kind, capital, counted
from liggghts_driver.report.numbers import decimals_for, fixed, number
from liggghts_driver.studies.paired import paired_change, ratios

if TYPE_CHECKING:
    from collections.abc import Iterator

    from liggghts_driver.paper.catalogue import Reading
    from liggghts_driver.paper.pooled import Pooled
    from liggghts_driver.paper.stored import Stored
    from liggghts_driver.studies.paired import Change


def change_of(stored: Stored, reading: Reading, section: str) -> Change | None:
    """The relative change over the packings; None where nothing can be compared."""
    own, base = _flows(stored, reading, section)
    return None if own is None or base is None else change_between(own, base)


def change_between(own: Pooled, base: Pooled) -> Change | None:
    """The relative change from one flow to another, packing by packing; None without a pair.

    Its interval is that between the packings, no narrower than the errors in time of both flows
    allow, which are taken as independent.
    """
    change = paired_change(own.values, base.values)
    if change is None or change.ci95 is None or own.in_time is None or base.in_time is None:
        return change
    shares = [each.in_time / each.mean for each in (own, base) if each.in_time and each.mean]
    in_time = (1.0 + change.mean) * math.hypot(*shares) / math.sqrt(change.replicates)
    return replace(change, ci95=max(change.ci95, in_time))


def remaining(stored: Stored, reading: Reading, section: str) -> list[float]:
    """What is left of the flow rate in each packing, as a share."""
    own, base = _flows(stored, reading, section)
    return [] if own is None or base is None else ratios(own.values, base.values)


def _flows(stored: Stored, reading: Reading, section: str) -> list[Pooled | None]:
    """The flow rate of a reading, and of what it is held against."""
    both = (reading, reading.beside or FIRST)
    return [flow(of_reading(stored, each), section) for each in both]


def is_told(change: Change) -> bool:
    """Whether a change is more than chance between the packings would make."""
    return change.ci95 is not None and abs(change.mean) > change.ci95


def change_words(change: Change) -> str:
    """A change in per cent with its interval."""
    if change.ci95 is None:
        return f"{exact_words(change.mean)}, one packing"
    decimals = decimals_for(100.0 * change.ci95)
    mean, half = (fixed(100.0 * abs(value), decimals) for value in (change.mean, change.ci95))
    # What rounds to zero has no sign.
    sign = "" if not mean.strip("0.") else "+" if change.mean > 0.0 else "−"
    return f"{sign}{mean} ± {half} %"


def exact_words(share: float) -> str:
    """A change in per cent that has no interval."""
    return f"{'+' if share > 0.0 else ''}{number(100.0 * share, 2)} %"


def sensitivity(stored: Stored) -> Iterator[str]:
    """Which readings change the flow beyond chance, which do not, and of which it is not known."""
    compared = 0
    for section in SECTIONS:
        kinds: dict[str, list[str]] = {"moves": [], "not told": [], "one": []}
        for reading in READINGS:
            change = change_of(stored, reading, section) if reading is not FIRST else None
            if change is not None:
                kind = "moves" if is_told(change) else "one" if change.ci95 is None else "not told"
                kinds[kind].append(f"*{reading.title}* ({change_words(change)}{_base(reading)})")
        told = {
            "moves": "what changes the flow beyond chance:",
            "not told": "no change beyond chance:",
            "one": "one packing only:",
        }
        compared += len(kinds["moves"]) + len(kinds["not told"])
        words = by_kind(told, kinds) or NOT_RUN
        yield f"{capital(section)}, beside *{FIRST.title}*: {words}."
    if compared:
        yield (
            f"Each interval is one of 95 %: of {counted(compared, 'comparison')} with several "
            f"packings about {number(0.05 * compared, 1)} would seem a change by chance alone."
        )


def _base(reading: Reading) -> str:
    """What a reading is held against, where it is not the first."""
    return f", beside *{reading.beside.title}*" if reading.beside not in (None, FIRST) else ""
