"""What pushes particles: the gradient inside the cube, the piston or the fluid before it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.paper import law
from liggghts_driver.paper.catalogue import AS_PRINTED, FIRST, MAIN, READINGS
from liggghts_driver.paper.changes import change_of, change_words
from liggghts_driver.paper.pooled import answers_of, by_gradient, flow, missing
from liggghts_driver.paper.printed import MAIN_GRADIENT_PA_M, SECTIONS
from liggghts_driver.paper.tables import table
from liggghts_driver.paper.words import FLOW_UNIT, listed, short_cell
from liggghts_driver.report.numbers import NONE, number

if TYPE_CHECKING:
    from collections.abc import Iterator

    from liggghts_driver.paper.stored import Stored

#: A change of the flow that is little beside that of the force, which becomes 26 times smaller.
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
    """What the lightest piston leaves of the flow past the middle, once several packings tell."""
    lightest = min(
        (each for each in READINGS if "piston.mass" in each.values),
        key=lambda each: float(each.values["piston.mass"]),
    )
    entrance, middle = (change_of(stored, lightest, name) for name in SECTIONS)
    if entrance is None or middle is None or middle.ci95 is None:
        return
    if abs(middle.mean) + middle.ci95 < _LITTLE < abs(entrance.mean):
        yield (
            "So the piston counts at the entrance, and hardly past the middle: there the gradient "
            "drives what has entered, and most of the piston's force rests on the grains."
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
        f"inside, at {middle_s:g} s (Eq. 18). So more enters than in *{FIRST.title}*, and it hangs "
        "on the gradient even less."
    )
