"""Fig. 6: how much friction slows the flow at the entrance, and whether it stops it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from liggghts_driver.paper.catalogue import FRICTIONS
from liggghts_driver.paper.changes import change_of, change_words, remaining
from liggghts_driver.paper.pooled import missing, of_reading
from liggghts_driver.paper.words import any_of, capital, counted
from liggghts_driver.report.numbers import number

if TYPE_CHECKING:
    from liggghts_driver.paper.catalogue import Reading
    from liggghts_driver.paper.stored import Stored
    from liggghts_driver.paper.words import Verdict

#: A flow below this share of that without friction has come to a stop.
STOPPED = 0.02


def friction_answer(stored: Stored) -> list[str]:
    """What each coefficient leaves of the flow over the second half."""
    return [_sentence(stored, reading) for reading in FRICTIONS]


def _sentence(stored: Stored, reading: Reading) -> str:
    change, left = change_of(stored, reading, "entrance"), remaining(stored, reading, "entrance")
    if change is None:
        return f"{capital(reading.title)}: {_nothing_to_compare(stored, reading)}."
    sweep = stored.sweeps.get(reading.sweep)
    rolling = sweep.settings.get("contact.rolling_friction", 0.0) if sweep else 0.0
    stopped = sum(share < STOPPED for share in left)
    count = f"{stopped} of {counted(len(left), 'packing')}"
    end = (
        f"; the entrance is obstructed in {count}, as the paper says may happen" if stopped else ""
    )
    share = number(100.0 * (1.0 + change.mean), 2)
    half = "" if change.ci95 is None else f" ± {number(100.0 * change.ci95, 2)}"
    return (
        f"{capital(reading.title)}, rolling {rolling:g}: {share}{half} % of the flow past the "
        f"entrance remains, {counted(len(left), 'packing')}{end}."
    )


def _nothing_to_compare(stored: Stored, reading: Reading) -> str:
    """Why there is no change: of the reading itself, or of what it is held against."""
    points = of_reading(stored, reading)
    ran = any(point.sound for point in points)
    return "nothing to hold it against" if ran else missing(points)


def obstruction(stored: Stored) -> tuple[str, Verdict]:
    """Whether friction obstructs the entrance in some run, and what each coefficient changes."""
    told, verdicts = [], []
    for reading in FRICTIONS:
        change = change_of(stored, reading, "entrance")
        left = remaining(stored, reading, "entrance")
        words = change_words(change) if change else _nothing_to_compare(stored, reading)
        told.append(f"{reading.title}: {words}")
        verdicts.append(_verdict(left))
    return "; ".join(told), any_of(verdicts)


def _verdict(left: list[float]) -> Verdict:
    """Something that may happen does so if it happens once; that it does not takes several runs."""
    if not left:
        return "not run yet"
    if min(left) < STOPPED:
        return "yes"
    return "no" if len(left) > 1 else "not decided"
