"""The time for a simulated second, of the paper and of our runs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.paper.catalogue import MAIN
from liggghts_driver.paper.pooled import by_gradient, seconds_per_second, seconds_per_step
from liggghts_driver.paper.printed import COST_S_PER_S, MAIN_GRADIENT_PA_M, STEP_S
from liggghts_driver.paper.tables import table
from liggghts_driver.paper.words import NOT_RUN, capital, counted
from liggghts_driver.report.numbers import NONE, number

if TYPE_CHECKING:
    from liggghts_driver.paper.stored import Answer, Point, Stored


def cost_sentence(stored: Stored) -> str:
    """The time for a simulated second at 10 Pa/m, beside the paper's."""
    points = by_gradient(stored, MAIN).get(MAIN_GRADIENT_PA_M, [])
    known = seconds_per_second(points)
    if not known:
        return f"{capital(NOT_RUN)}."
    seconds = float(np.median(known))
    first = next(p.answer for p in points if p.answer is not None)
    longer = first.cost["step_s"] / STEP_S
    each, printed = 1e3 * float(np.median(seconds_per_step(points))), 1e3 * COST_S_PER_S * STEP_S
    return (
        f"A simulated second takes {number(seconds)} s of processor time ({_how(first)}, "
        f"{counted(len(known), 'run')} at {MAIN_GRADIENT_PA_M:g} Pa/m), where the paper says "
        f"0.06 h = {COST_S_PER_S:g} s: {_less(seconds / COST_S_PER_S)}, of which "
        f"{number(longer, 2)} by a longer step. A step takes {number(each, 2)} ms, the paper's "
        f"{number(printed, 2)} ms: {_less(each / printed)}."
    )


def _less(ratio: float) -> str:
    """Ours over the paper's, in words."""
    return f"{number(1.0 / ratio, 2)} times less" if ratio < 1.0 else f"{number(ratio, 2)} times"


def _how(answer: Answer) -> str:
    machine = answer.provenance["machine"]
    where = f"one core of {machine['cpu']}" if machine else "a machine that is not known"
    return f"{where}, a step of {number(1e3 * answer.cost['step_s'], 2)} ms"


def cost_table(stored: Stored) -> str:
    """Time for a simulated second: of the paper, and ours on each machine."""
    groups: dict[str, list[Point]] = {}
    for point in stored.points():
        if point.answer is not None:
            groups.setdefault(_machine_words(point), []).append(point)
    each = number(1e3 * COST_S_PER_S * STEP_S)
    paper = ["the paper, a laptop at 2.0 GHz", "1", "0.1 ms", f"{COST_S_PER_S:g}", NONE, each]
    rows = [[*paper, "1", NONE]]
    for machine, points in sorted(groups.items()):
        answers = [p.answer for p in points if p.answer is not None]
        seconds = seconds_per_second(points)
        if seconds:
            median = float(np.median(seconds))
            reach = f"{number(min(seconds))} to {number(max(seconds))}"
            steps = ", ".join(
                f"{number(1e3 * step, 2)} ms"
                for step in sorted({a.cost["step_s"] for a in answers})
            )
            ranks = ", ".join(str(n) for n in sorted({a.cost["ranks"] for a in answers}))
            ratio = number(COST_S_PER_S / median, 2)
            each = number(1e3 * float(np.median(seconds_per_step(points))))
            cells = [machine, ranks, steps, number(median), reach, each]
            rows.append([*cells, ratio, str(len(seconds))])
    heads = ["machine", "processes", "step", "s per simulated s, median", "range"]
    return table([*heads, "ms per step", "times faster", "runs"], rows)


def _machine_words(point: Point) -> str:
    """The machine of a run, as far as it is known."""
    made = point.answer.provenance["machine"] if point.answer is not None else None
    return f"{made['cpu']}, {made['cores']} cores" if made else "a machine that is not known"
