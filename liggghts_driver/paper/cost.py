"""The time for a simulated second, of the paper and of our runs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.paper.catalogue import SETTINGS
from liggghts_driver.paper.printed import COST_S_PER_S, STEP_S
from liggghts_driver.paper.settings import cheaper_sweeps
from liggghts_driver.paper.stored import NOT_RUN
from liggghts_driver.paper.tables import table
from liggghts_driver.paper.words import capital, counted, listed, reach
from liggghts_driver.report.numbers import NONE, number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from liggghts_driver.paper.stored import Point, Stored

#: How stiff the contacts of a run are.
_SOFTER, _AS_PRINTED = "ten times softer", "the paper's"


def cost_sentence(stored: Stored) -> str:
    """The time for a simulated second, beside the paper's: with our settings, and with its own."""
    points = [p for p in _with_settings(stored, ours=True) if p.answer is not None]
    known = _seconds_per_second(points)
    if not known:
        return f"{capital(NOT_RUN)}."
    steps = [1e3 * each for each in _seconds_per_step(points)]
    printed = 1e3 * COST_S_PER_S * STEP_S
    longer = np.median([p.answer.cost["step_s"] for p in points if p.answer]) / STEP_S
    machines = listed(sorted({_machine_words(point) for point in points}))
    return (
        f"A simulated second takes {_middle_and_reach(known)} s of processor time "
        f"({counted(len(known), 'run')} on one core each; {machines}), where the paper says 0.06 h "
        f"= {COST_S_PER_S:g} s: {_less(known, COST_S_PER_S)}. Steps are {number(float(longer), 2)} "
        f"times as long (with softer contacts), and one takes {_middle_and_reach(steps)} ms, the "
        f"paper's {number(printed, 2)} ms: {_less(steps, printed)}.{_like_for_like(stored)} All "
        "are medians."
    )


def _like_for_like(stored: Stored) -> str:
    """The time for a simulated second at the paper's own step and stiffness."""
    known = _seconds_per_second(_with_settings(stored, ours=False))
    if not known:
        return ""
    return (
        f" At the paper's own step and stiffness a simulated second takes "
        f"{_middle_and_reach(known)} s ({counted(len(known), 'run')}): "
        f"{_less(known, COST_S_PER_S)}."
    )


def _with_settings(stored: Stored, *, ours: bool) -> list[Point]:
    """The points with our settings, or those with the paper's."""
    names = [sweep.name for sweep in cheaper_sweeps(stored)] if ours else [SETTINGS.sweep]
    return [point for name in names for point in stored.points(name)]


def _seconds_per_second(points: Sequence[Point]) -> list[float]:
    """Processor time for a simulated second of each run whose time is known."""
    costs = [point.answer.cost for point in points if point.answer is not None]
    return [cost["cpu_s"] / cost["simulated_s"] for cost in costs if cost["cpu_s"]]


def _seconds_per_step(points: Sequence[Point]) -> list[float]:
    """Processor time for a step of each run whose time is known."""
    costs = [point.answer.cost for point in points if point.answer is not None]
    return [c["cpu_s"] / c["simulated_s"] * c["step_s"] for c in costs if c["cpu_s"]]


def _middle_and_reach(values: Sequence[float]) -> str:
    """The median, and from the smallest to the largest."""
    middle, span = number(float(np.median(values)), 2), reach(values)
    return middle if span == middle else f"{middle} ({span})"


def _less(ours: Sequence[float], printed: float) -> str:
    """How many times less than the paper's."""
    return f"{_middle_and_reach([printed / each for each in ours])} times less"


def cost_table(stored: Stored) -> str:
    """Time for a simulated second: of the paper, and ours for settings, machine and day."""
    groups: dict[tuple[str, str, str], list[Point]] = {}
    for contacts, ours in ((_SOFTER, True), (_AS_PRINTED, False)):
        for point in _with_settings(stored, ours=ours):
            if point.answer is not None:
                day = str(point.answer.provenance["started"] or NONE)[:10]
                groups.setdefault((_machine_words(point), day, contacts), []).append(point)
    each = number(1e3 * COST_S_PER_S * STEP_S)
    paper = ["the paper, a laptop at 2.0 GHz", NONE, "1", _AS_PRINTED, "0.1 ms"]
    rows = [[*paper, f"{COST_S_PER_S:g}", NONE, each, "1", NONE]]
    rows += [
        [machine, day, *_cost_cells(contacts, points)]
        for (machine, day, contacts), points in sorted(groups.items())
        if _seconds_per_second(points)
    ]
    heads = ["machine", "begun", "processes", "contacts", "step", "s per simulated s, median"]
    return table([*heads, "range", "ms per step", "times faster", "runs"], rows)


def _cost_cells(contacts: str, points: Sequence[Point]) -> list[str]:
    """What the runs of a machine and a day took, with the same contacts."""
    answers, seconds = [p.answer for p in points if p.answer], _seconds_per_second(points)
    median = float(np.median(seconds))
    steps = sorted({a.cost["step_s"] for a in answers})
    return [
        ", ".join(str(n) for n in sorted({a.cost["ranks"] for a in answers})),
        contacts,
        ", ".join(f"{number(1e3 * step, 2)} ms" for step in steps),
        number(median),
        reach(seconds, 3),
        number(1e3 * float(np.median(_seconds_per_step(points)))),
        number(COST_S_PER_S / median, 2),
        str(len(seconds)),
    ]


def _machine_words(point: Point) -> str:
    """The machine of a run, as far as it is known."""
    made = point.answer.provenance["machine"] if point.answer is not None else None
    return f"{made['cpu']}, {made['cores']} cores" if made else "a machine that is not known"
