"""The page in Markdown, from the stored results alone: the same results give the same bytes."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

import jinja2
import numpy as np

from liggghts_driver.paper import answers, explain, law, tables
from liggghts_driver.paper.catalogue import ALL_GRADIENTS, MAIN, TABLE_READINGS
from liggghts_driver.paper.figures import DRAWINGS, SNAPSHOTS, first_run
from liggghts_driver.paper.pooled import (
    LATE,
    by_gradient,
    flow,
    seconds_per_second,
    seconds_per_step,
    velocity,
)
from liggghts_driver.paper.printed import COST_S_PER_S, MAIN_GRADIENT_PA_M, ROWS, STEP_S, TABLE_1
from liggghts_driver.paper.statements import slips, statements
from liggghts_driver.paper.validity import validity_answer
from liggghts_driver.paper.verdict import reading_answer
from liggghts_driver.paper.words import (
    ARRIVING,
    DRIFTS,
    NOT_RUN,
    capital,
    counted,
    judge,
    listed,
    short_cell,
)
from liggghts_driver.report.numbers import number
from liggghts_driver.resources import templates_dir

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from liggghts_driver.paper.catalogue import Series
    from liggghts_driver.paper.pooled import Pooled
    from liggghts_driver.paper.stored import Answer, Stored

_STEADY_LEGEND = (
    f"{DRIFTS}: over the second half the flow is not steady in some packing. {ARRIVING}: in some "
    f"packing the first particle came after {LATE:g} of the run or later: the front is still "
    "arriving, and no exponent is drawn through such a rate."
)
#: What becomes of the flow rates of Table 1.
_KINDS = {
    "agrees": "within our interval",
    "differs": "outside",
    "undecided": "not decided",
    "arriving": "where our flow is still arriving",
    "one packing": "known from one packing alone",
    "unknown": "not known yet",
}


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
        "agreement": [*_steady(stored), *_agreement(stored), *_velocities(stored)],
        "steady_legend": _STEADY_LEGEND,
        "readings": reading_answer(stored),
        "power": answers.power_answer(stored),
        "steady": answers.steady_answer(stored),
        "validity": validity_answer(stored, ALL_GRADIENTS),
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
        kinds = Counter(
            _kind(flow(points.get(row.gradient_pa_m, []), section), row.flow_m3_s(section))
            for row in TABLE_1
            for section in answers.SECTIONS
        )
        if kinds["unknown"] == kinds.total():
            yield f"{capital(reading.title)}: {NOT_RUN}."
            continue
        parts = [f"{kinds[kind]} {words}" for kind, words in _KINDS.items() if kinds[kind]]
        yield (
            f"{capital(reading.title)}: of {kinds.total()} simulated flow rates of Table 1, "
            f"{listed(parts)}."
        )


def _kind(pooled: Pooled | None, printed: float) -> str:
    return "arriving" if pooled and pooled.late else judge(pooled, printed).kind


def _steady(stored: Stored) -> Iterator[str]:
    """How many flow rates of single runs are steady."""
    rates = [r for p in stored.points() if p.sound for r in p.sound.flow_m3_s.values()]
    if rates:
        yield (
            f"{sum(rate.steady for rate in rates)} of {counted(len(rates), 'flow rate')} of single "
            f"runs are steady over the second half; means with others in them are marked {DRIFTS}."
        )


def _velocities(stored: Stored) -> Iterator[str]:
    """How our mean velocity, with its interval, lies to the paper's range."""
    for reading in TABLE_READINGS:
        kinds: dict[str, list[str]] = {}
        for gradient, points in by_gradient(stored, reading).items():
            mean = velocity(points)
            if mean is not None and gradient in ROWS:
                kind = _to_range(mean, ROWS[gradient].velocity_m_s)
                kinds.setdefault(kind, []).append(f"{gradient:g}")
        parts = [f"{kind} at {listed(some)} Pa/m" for kind, some in kinds.items()]
        if parts:
            yield f"{capital(reading.title)}: the mean velocity is {listed(parts)}."
        yield from _pushed(stored, reading)


def _to_range(mean: Pooled, printed: tuple[float, float]) -> str:
    """Where the interval of a velocity lies beside a printed range; one packing decides nothing."""
    if mean.between is None:
        return "known from one packing alone"
    low, high = mean.mean - mean.between, mean.mean + mean.between
    if printed[0] <= low and high <= printed[1]:
        return "in the paper's range"
    if high < printed[0]:
        return "below the paper's range"
    if low > printed[1]:
        return "above the paper's range"
    return "compatible with the paper's range within its interval"


def _pushed(stored: Stored, reading: Series) -> Iterator[str]:
    """Where particles go as fast among grains as a lone one without any: that takes a push."""
    for gradient, points in by_gradient(stored, reading).items():
        mean, free = velocity(points), law.free_flight_m_s(gradient)
        if mean is not None and mean.packings > 1 and mean.mean > free:
            yield (
                f"At {gradient:g} Pa/m the mean velocity, {short_cell(mean, 1e-3)} mm/s, is not "
                f"below that of free flight, {number(1e3 * free)} mm/s, although grains stand in "
                "the way: something pushes from behind."
            )


def _cost(stored: Stored) -> str:
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
