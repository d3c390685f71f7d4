"""Fig. 6: how much friction slows the flow at the entrance, and whether it stops it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from liggghts_driver.paper.catalogue import FRICTIONS
from liggghts_driver.paper.changes import change_of, change_words, remaining
from liggghts_driver.paper.pooled import answers_of, missing, of_reading
from liggghts_driver.paper.windows import PARTICLE_M3
from liggghts_driver.paper.words import any_of, capital, counted, reach
from liggghts_driver.report.numbers import number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from liggghts_driver.paper.catalogue import Reading
    from liggghts_driver.paper.stored import Stored
    from liggghts_driver.paper.words import Verdict

#: A flow below this share of that without friction is nearly stopped.
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
    share = number(100.0 * (1.0 + change.mean), 2)
    half = "" if change.ci95 is None else f" ± {number(100.0 * change.ci95, 2)}"
    return (
        f"{capital(reading.title)}, rolling {rolling:g}: {share}{half} % of the flow past the "
        f"entrance remains, {counted(len(left), 'packing')}{_at_the_end(stored, reading, left)}."
    )


def _at_the_end(stored: Stored, reading: Reading, left: Sequence[float]) -> str:
    """How many particles still enter at the end, where friction nearly stops them."""
    if not left or min(left) >= STOPPED:
        return ""
    late = _late(stored, reading)
    if 0 not in late:
        return f"; in the last quarter of the run {reach(late)} particles still enter"
    stopped = f"{late.count(0)} of {counted(len(late), 'packing')}"
    return f"; in the last quarter of the run no particle enters in {stopped}"


def _late(stored: Stored, reading: Reading) -> list[int]:
    """How many particles pass the entrance in the last quarter of each run."""
    several = [answer.curves for answer in answers_of(of_reading(stored, reading)).values()]
    return [round(c.passed_m3("entrance", c.quarters()[1]) / PARTICLE_M3) for c in several]


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
        told.append(f"{reading.title}: {words}{_at_the_end(stored, reading, left)}")
        verdicts.append(_verdict(left, _late(stored, reading)))
    return "; ".join(told), any_of(verdicts)


def _verdict(left: Sequence[float], late: Sequence[int]) -> Verdict:
    """Something that may happen does so if it happens once; that it does not takes several runs.

    Completely is when no particle enters in the last quarter of a run; nearly, in part.
    """
    if not left:
        return "not run yet"
    if 0 in late:
        return "yes"
    if min(left) < STOPPED:
        return "in part"
    return "no" if len(left) > 1 else "not decided"
