"""The page in Markdown, from the stored results alone: the same results give the same bytes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import jinja2
import numpy as np

from liggghts_driver.paper import answers, explain, tables
from liggghts_driver.paper.catalogue import ALL_GRADIENTS, MAIN, TABLE_READINGS
from liggghts_driver.paper.figures import DRAWINGS, SNAPSHOTS, first_run
from liggghts_driver.paper.pooled import by_gradient, flow, seconds_per_second, velocity
from liggghts_driver.paper.printed import COST_S_PER_S, MAIN_GRADIENT_PA_M, ROWS, TABLE_1
from liggghts_driver.paper.statements import slips, statements
from liggghts_driver.paper.words import NOT_RUN, capital, counted, judge
from liggghts_driver.report.numbers import number
from liggghts_driver.resources import templates_dir

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from liggghts_driver.paper.stored import Answer, Stored


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
        "done": done,
        "points": len(points),
        "settings": _settings(stored),
        "agreement": [*_agreement(stored), *_velocities(stored)],
        "readings": answers.reading_answer(stored),
        "power": answers.power_answer(stored),
        "steady": answers.steady_answer(stored),
        "validity": answers.validity_answer(stored, ALL_GRADIENTS),
        "explained": explain.explain_answer(stored),
        "friction": explain.friction_answer(stored),
        "what_if": explain.what_if_answer(stored),
        "statements": statements(),
        "slips": slips(),
        "cost": _cost(stored),
        "tables": {
            "flow": tables.flow_table(stored),
            "velocity": tables.velocity_table(stored),
            "readings": tables.readings_table(stored),
            "exponents": tables.exponent_table(stored),
            "validity": tables.validity_table(stored),
            "runs": tables.runs_table(stored),
            "cost": tables.cost_table(stored),
        },
        "failures": list(_failures(stored)),
        "provenance": _provenance(stored),
        "has_snapshots": first_run(stored) is not None,
        "image": {name: f"images/{name}.png" for name in (*(d.name for d in DRAWINGS), SNAPSHOTS)},
    }


def _settings(stored: Stored) -> list[str]:
    """The settings that all sweeps share, as TOML would have them."""
    several = [dict(sweep.settings) for sweep in stored.sweeps.values()]
    if not several:
        return []
    shared: Mapping[str, Any] = several[0]
    return [
        f"{key} = {value}"
        for key, value in shared.items()
        if all(each.get(key) == value for each in several)
    ]


def _agreement(stored: Stored) -> Iterator[str]:
    """How much of Table 1's flow rates each reading of the outside fluid gives."""
    for reading in TABLE_READINGS:
        points = by_gradient(stored, reading)
        kinds = [
            judge(flow(points.get(row.gradient_pa_m, []), s), row.flow_m3_s(s)).kind
            for row in TABLE_1
            for s in answers.SECTIONS
        ]
        judged = len(kinds) - kinds.count("unknown")
        if not judged:
            yield f"{capital(reading.title)}: {NOT_RUN}."
            continue
        waiting = f", {kinds.count('unknown')} not known yet" if judged < len(kinds) else ""
        yield (
            f"{capital(reading.title)}: of {len(kinds)} simulated flow rates of Table 1, "
            f"{kinds.count('agrees')} within our interval, {kinds.count('differs')} outside, "
            f"{kinds.count('undecided')} not decided{waiting}."
        )


def _velocities(stored: Stored) -> Iterator[str]:
    """Whether our mean velocity lies in the paper's range."""
    for reading in TABLE_READINGS:
        inside: list[str] = []
        outside: list[str] = []
        for gradient, points in by_gradient(stored, reading).items():
            mean = velocity(points)
            if mean is not None and gradient in ROWS:
                low, high = ROWS[gradient].velocity_m_s
                (inside if low <= mean.mean <= high else outside).append(f"{gradient:g}")
        if inside or outside:
            where = f" ({', '.join(inside)} Pa/m)" if inside else ""
            total = counted(len(inside) + len(outside), "gradient")
            yield (
                f"{capital(reading.title)}: the mean velocity lies in the paper's range at "
                f"{len(inside)} of {total}{where}."
            )


def _cost(stored: Stored) -> str:
    """The time for a simulated second at 10 Pa/m, beside the paper's."""
    points = by_gradient(stored, MAIN).get(MAIN_GRADIENT_PA_M, [])
    known = seconds_per_second(points)
    if not known:
        return f"{capital(NOT_RUN)}."
    seconds = float(np.median(known))
    first = next(p.answer for p in points if p.answer is not None)
    return (
        f"A simulated second takes {number(seconds)} s of processor time ({_how(first)}, "
        f"{counted(len(known), 'run')} at {MAIN_GRADIENT_PA_M:g} Pa/m), where the paper says "
        f"0.06 h = {COST_S_PER_S:g} s: {number(COST_S_PER_S / seconds, 2)} times "
        f"{'less' if seconds < COST_S_PER_S else 'as much'}."
    )


def _how(answer: Answer) -> str:
    machine = answer.provenance["machine"]
    where = f"one core of {machine['cpu']}" if machine else "a machine that is not known"
    return f"{where}, a step of {number(1e3 * answer.cost['step_s'], 2)} ms"


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
