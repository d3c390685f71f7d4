"""The page in Markdown, from the stored results alone: the same results give the same bytes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import jinja2

from liggghts_driver.paper import law, tables
from liggghts_driver.paper.agreement import flow_agreement, velocity_agreement
from liggghts_driver.paper.catalogue import ALL_GRADIENTS
from liggghts_driver.paper.choices import choices_answer, choices_table
from liggghts_driver.paper.claims import claims
from liggghts_driver.paper.cost import cost_sentence, cost_table
from liggghts_driver.paper.explain import explain_answer
from liggghts_driver.paper.figures import DRAWINGS, SNAPSHOTS, first_run
from liggghts_driver.paper.friction import STOPPED, friction_answer
from liggghts_driver.paper.phases import phases_answer
from liggghts_driver.paper.power import power_answer
from liggghts_driver.paper.printed import LARGEST_REYNOLDS, SECTIONS, TABLE_1
from liggghts_driver.paper.push import push_answer, push_table
from liggghts_driver.paper.settings import settings_answer, shared_settings
from liggghts_driver.paper.statements import slips, statements
from liggghts_driver.paper.steadiness import steady_answer
from liggghts_driver.paper.stored import NOT_RUN
from liggghts_driver.paper.validity import validity_answer
from liggghts_driver.paper.verdict import reading_answer
from liggghts_driver.paper.what_if import what_if_answer
from liggghts_driver.paper.windows import GROWTH
from liggghts_driver.paper.words import DRIFTS, RISING, capital, counted
from liggghts_driver.report.numbers import number
from liggghts_driver.resources import templates_dir

if TYPE_CHECKING:
    from collections.abc import Iterator

    from liggghts_driver.paper.stored import Stored

#: By this the page is known again, before it is written anew.
WRITTEN_BY = "Written by `liggghts-driver study paper`"
_STEADY_LEGEND = (
    f"{DRIFTS}: over the second half the flow is not steady in some packing. {RISING}: in some "
    f"packing the last quarter of the run has more than {GROWTH:g} times the rate of the quarter "
    "before, and more than by chance: the flow still comes up, and its rate is left out of the "
    "exponents."
)

#: Over a sphere that just passes between three touching ones, their size: 1 / (2 / sqrt(3) - 1).
_THROAT = 1.0 / (2.0 / math.sqrt(3.0) - 1.0)


def render_page(stored: Stored) -> str:
    """``docs/paper.md``.

    Parameters
    ----------
    stored
        The results.
    """
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(templates_dir()),
        undefined=jinja2.StrictUndefined,
        autoescape=False,  # noqa: S701 - Markdown, from numbers and our own words
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template("paper.md.j2").render(context_of(stored))


def context_of(stored: Stored) -> dict[str, Any]:
    """Everything that the page shows."""
    points = list(stored.points())
    done = sum(point.answer is not None for point in points)
    return {
        "written_by": WRITTEN_BY,
        "done": done,
        "points": len(points),
        "settings": {"shared": shared_settings(stored), "error": settings_answer(stored)},
        "claims": claims(stored),
        "choices": choices_answer(stored),
        "agreement": list(flow_agreement(stored)),
        "velocities": list(velocity_agreement(stored)),
        "steady_legend": _STEADY_LEGEND,
        "readings": reading_answer(stored),
        "phases": phases_answer(stored),
        "push": list(push_answer(stored)),
        "piston": {
            "mass": number(law.piston_mass_kg(), 2),
            "force": number(1e3 * law.piston_force_n(), 2),
        },
        "stopped": number(100.0 * STOPPED, 1),
        "printed_power": {
            name: tables.printed_exponent(*law.slow_gradients(), name) for name in SECTIONS
        },
        "sizes": {"ratio": number(law.size_ratio()), "throat": number(_THROAT)},
        "reynolds": _reynolds(),
        "power": power_answer(stored),
        "steady": steady_answer(stored),
        "validity": validity_answer(stored, ALL_GRADIENTS),
        "explained": explain_answer(stored),
        "friction": friction_answer(stored),
        "what_if": what_if_answer(stored),
        "statements": statements(),
        "slips": slips(),
        "cost": cost_sentence(stored),
        "tables": {
            "flow": tables.flow_table(stored),
            "velocity": tables.velocity_table(stored),
            "choices": choices_table(stored),
            "readings": tables.readings_table(stored),
            "push": push_table(stored),
            "exponents": tables.exponent_table(stored),
            "validity": tables.validity_table(stored),
            "runs": tables.runs_table(stored),
            "cost": cost_table(stored),
        },
        "failures": list(_failures(stored)),
        "provenance": _provenance(stored),
        "has_snapshots": first_run(stored) is not None,
        "image": {name: f"images/{name}.png" for name in (*(d.name for d in DRAWINGS), SNAPSHOTS)},
    }


def _reynolds() -> dict[str, str]:
    """The Reynolds numbers by which the law's end may be told."""
    inside, outside = law.slow_gradients()[1], TABLE_1[-1].gradient_pa_m
    specimen = law.example().specimen
    assert specimen is not None
    found = {
        "inside": law.law_reynolds(inside),
        "outside": law.law_reynolds(outside),
        "pores": law.law_reynolds(inside) / (1.0 - specimen.solid_fraction),
        "flight": law.free_flight_reynolds(TABLE_1[0].gradient_pa_m),
        "grains": law.grain_reynolds(inside),
        "mixture": law.mixture_reynolds(inside),
        "limit": LARGEST_REYNOLDS / law.grain_reynolds(1.0),
    }
    return {name: number(value, 2) for name, value in found.items()}


def _failures(stored: Stored) -> Iterator[str]:
    """What has no usable answer, and why."""
    for sweep in stored.sweeps.values():
        for point in sweep.points:
            place = ", ".join(f"{key} = {value}" for key, value in point.values.items())
            where = f"`{sweep.name}.toml`, {place}, seed {point.seed}"
            if point.state == "failed":
                yield f"{where}: failed: {point.why}"
            elif point.answer is not None and point.answer.verdict == "invalid":
                yield f"{where}: invalid: {'; '.join(point.answer.reasons)}"


def _provenance(stored: Stored) -> str:
    """Versions and dates of the runs."""
    made = [p.answer.provenance for p in stored.points() if p.answer is not None]
    if not made:
        return f"{capital(NOT_RUN)}."
    engines = ", ".join(sorted({str(each["engine"]) for each in made}))
    drivers = ", ".join(sorted({str(each["liggghts_driver"]) for each in made}))
    dates = sorted(str(each["started"])[:10] for each in made if each["started"])
    when = f", begun {dates[0]} to {dates[-1]}" if dates else ""
    return f"{counted(len(made), 'run')}, {engines}, liggghts-driver {drivers}{when}."
