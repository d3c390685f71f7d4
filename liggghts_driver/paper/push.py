"""What pushes particles: the gradient inside the cube, the piston or the fluid before it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.paper import law
from liggghts_driver.paper.catalogue import AS_PRINTED, FIRST, MAIN, PRINTED, READINGS
from liggghts_driver.paper.changes import change_of, change_words, is_told
from liggghts_driver.paper.pooled import (
    answers_of,
    by_gradient,
    flow,
    missing,
    of_reading,
    velocity,
)
from liggghts_driver.paper.power import power_of
from liggghts_driver.paper.printed import MAIN_GRADIENT_PA_M, SECTIONS
from liggghts_driver.paper.tables import table
from liggghts_driver.paper.words import FLOW_UNIT, listed, reach, short_cell
from liggghts_driver.report.numbers import NONE, number

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from liggghts_driver.paper.catalogue import Reading
    from liggghts_driver.paper.stored import Stored

#: A change of the flow that is little beside that of the force, which becomes 26 times less.
_LITTLE = 0.25


def push_table(stored: Stored) -> str:
    """The force of the gradient on all particles inside at the end, beside the piston's."""
    rows = []
    for gradient, points in by_gradient(stored, MAIN).items():
        inside = [answer.inside for answer in answers_of(points).values()]
        rate = short_cell(flow(points, "entrance"), FLOW_UNIT, missing(points))
        cells = [missing(points), NONE, NONE]
        if inside:
            count = float(np.mean(inside))
            force = count * law.pressure_force_on_one_n(gradient)
            cells = [
                number(round(count)),
                number(1e3 * force, 2),
                number(law.piston_force_n() / force, 2),
            ]
        rows.append([f"{gradient:g}", *cells, rate])
    heads = ["Pa/m", "particles inside at the end", "force of the gradient on them, mN"]
    return table([*heads, "the piston's over it", "flow past the entrance, 10⁻⁶ m³/s"], rows)


def _at_the_middle(stored: Stored) -> Iterator[str]:
    """Why the lightest piston leaves the flow past the middle, once several packings tell."""
    lightest = min(
        (each for each in READINGS if "piston.mass" in each.values),
        key=lambda each: float(each.values["piston.mass"]),
    )
    entrance, middle = (change_of(stored, lightest, name) for name in SECTIONS)
    speed = velocity(of_reading(stored, lightest))
    if entrance is None or middle is None or middle.ci95 is None or speed is None:
        return
    if not abs(middle.mean) + middle.ci95 < _LITTLE < abs(entrance.mean):
        return
    curves = [answer.curves for answer in answers_of(of_reading(stored, lightest)).values()]
    enters, leaves = ([c.last_quarter_m3_s(name) / FLOW_UNIT for c in curves] for name in SECTIONS)
    yield (
        "So the piston counts at the entrance. The middle hardly feels it within the run: at "
        f"{number(1e3 * speed.mean)} mm/s a particle needs "
        f"{number(law.to_the_middle_m() / speed.mean, 2)} s from the entrance to there."
        f"{_it_empties(lightest, enters, leaves)}"
    )


def _it_empties(lightest: Reading, enters: Sequence[float], leaves: Sequence[float]) -> str:
    """Whether more leaves the half before the middle than enters it: then that cannot last."""
    if max(enters) >= min(leaves):
        return ""
    return (
        f" In the last quarter of the runs with {lightest.values['piston.mass']:g} kg "
        f"{reach(enters)} enter and {reach(leaves)} pass the middle, in 10⁻⁶ m³/s: the half "
        "between empties, and what passes the middle will have to follow."
    )


def push_answer(stored: Stored) -> Iterator[str]:
    """What a lighter piston changes, and what the fluid of the printed reading does instead."""
    for reading in READINGS:
        mass = reading.values.get("piston.mass")
        changes = {name: change_of(stored, reading, name) for name in SECTIONS}
        known = {name: change for name, change in changes.items() if change is not None}
        if mass is not None and len(known) == len(SECTIONS):
            told = listed([f"past the {n} by {change_words(c)}" for n, c in known.items()])
            lighter = number(law.piston_mass_kg() / mass, 2)
            yield f"A piston {lighter} times lighter ({mass:g} kg) changes the flow {told}."
    yield from _at_the_middle(stored)
    middle_s = 0.5 * law.example().time.duration
    ratio = number(law.drag_over_pressure_force(middle_s, MAIN_GRADIENT_PA_M), 2)
    yield (
        f"In *{AS_PRINTED.title}* the fluid before the cube presses too: its drag on a particle "
        f"that waits there is {ratio} times the force of {MAIN_GRADIENT_PA_M:g} Pa/m on one "
        f"inside, at {middle_s:g} s (Eq. 18).{_so_more_enters(stored)}"
    )


def _so_more_enters(stored: Stored) -> str:
    """What that drag does to the flow past the entrance, as far as several packings tell."""
    change = change_of(stored, AS_PRINTED, "entrance")
    if change is None or not is_told(change) or change.mean < 0.0:
        return ""
    own, first = (power_of(stored, series, "entrance") for series in (PRINTED, MAIN))
    less = ""
    if own is not None and first is not None and own.is_below(first):
        less = ", and it hangs on the gradient even less"
    return f" So more enters than in *{FIRST.title}*{less}."
