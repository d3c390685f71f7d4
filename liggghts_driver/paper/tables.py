"""The tables of the page, in Markdown."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.paper import law
from liggghts_driver.paper.catalogue import (
    ALL_GRADIENTS,
    FIRST,
    FOLLOWS,
    FRICTIONS,
    MAIN,
    PRINTED,
    READINGS,
    TABLE_READINGS,
    VISCOUS,
)
from liggghts_driver.paper.changes import change_of, change_words, is_told
from liggghts_driver.paper.pooled import (
    by_gradient,
    exponent,
    flow,
    flows_by_gradient,
    local_exponents,
    missing,
    of_reading,
    velocity,
    velocity_range,
)
from liggghts_driver.paper.power import fitted
from liggghts_driver.paper.printed import MAIN_GRADIENT_PA_M, ROWS, SECTIONS, TABLE_1
from liggghts_driver.paper.words import FLOW_UNIT, cell, judge, marks, short_cell
from liggghts_driver.report.numbers import NONE, number, with_error

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from liggghts_driver.paper.catalogue import Reading
    from liggghts_driver.paper.pooled import Pooled
    from liggghts_driver.paper.stored import Point, Stored

#: Velocities are said in millimetres per second.
_VELOCITY_UNIT = 1e-3
#: In place of an exponent where a flow still comes up.
_RISES = "still coming up"


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def flow_table(stored: Stored) -> str:
    """Table 1 of the paper with ours beside it: flow rates of particles."""
    heads = ["Pa/m", "section", "law, printed", "law, ours", "DEM, printed"]
    found = [by_gradient(stored, series) for series in TABLE_READINGS]
    rows = []
    for row in TABLE_1:
        for section in SECTIONS:
            printed = [row.law_m3_s, law.law_flow_m3_s(row.gradient_pa_m), row.flow_m3_s(section)]
            several = [points.get(row.gradient_pa_m, []) for points in found]
            ours = [(flow(points, section), missing(points)) for points in several]
            rows.append(
                [
                    f"{row.gradient_pa_m:g}",
                    section,
                    *(number(value / FLOW_UNIT) for value in printed),
                    *(cell(each, FLOW_UNIT, why) for each, why in ours),
                ]
            )
    return table([*heads, *(s.name for s in TABLE_READINGS)], rows)


def velocity_table(stored: Stored) -> str:
    """Velocities: the law's q / v2, the paper's simulation, free flight, ours."""
    heads = ["Pa/m", "law, printed", "law, ours", "free flight", "DEM, printed"]
    found = [by_gradient(stored, series) for series in TABLE_READINGS]
    rows = []
    for row in TABLE_1:
        g = row.gradient_pa_m
        theory = [row.law_m_s, law.law_velocity_m_s(g), law.free_flight_m_s(g)]
        low, high = (number(v / _VELOCITY_UNIT) for v in row.velocity_m_s)
        ours = [_velocity_cell(points.get(g, [])) for points in found]
        cells = [number(value / _VELOCITY_UNIT) for value in theory]
        rows.append([f"{g:g}", *cells, f"{low} to {high}", *ours])
    return table([*heads, *(s.name for s in TABLE_READINGS)], rows)


def _velocity_cell(points: Sequence[Point]) -> str:
    """Mean over the packings with its interval between them, and the range in time."""
    mean, reach = velocity(points), velocity_range(points)
    if mean is None or reach is None:
        return missing(points)
    low, high = (number(v / _VELOCITY_UNIT) for v in reach)
    own = mean.mean / _VELOCITY_UNIT
    half = None if mean.interval is None else mean.interval / _VELOCITY_UNIT
    return f"{with_error(own, half)}; {low} to {high}{marks(mean)}"


def readings_table(stored: Stored) -> str:
    """Every reading at 10 Pa/m: flow rates, whether they agree, and what the reading changes."""
    printed = ROWS[MAIN_GRADIENT_PA_M]
    rows = []
    for reading in (*READINGS, *FRICTIONS):
        points = of_reading(stored, reading)
        cells = [reading.title]
        for section in SECTIONS:
            pooled = flow(points, section)
            kind = judge(pooled, printed.flow_m3_s(section)).kind
            # Table 1 has no friction.
            held = pooled is not None and reading in READINGS
            cells += [cell(pooled, FLOW_UNIT, missing(points)), kind if held else NONE]
            cells += [_change(stored, reading, section)]
        rows.append([*cells, _velocity_cell(points)])
    per_section = [
        head for s in SECTIONS for head in (f"{s}, 10⁻⁶ m³/s", "with the paper", "change")
    ]
    return table(["reading", *per_section, "velocity, mm/s"], rows)


def _change(stored: Stored, reading: Reading, section: str) -> str:
    """A change beside what a reading is held against; in brackets where it may be none."""
    change = change_of(stored, reading, section) if reading is not FIRST else None
    if change is None:
        return NONE
    words = change_words(change)
    return words if is_told(change) or change.ci95 is None else f"({words})"


def exponent_table(stored: Stored) -> str:
    """The power of the gradient: between the paper's neighbouring gradients, and fitted."""
    gradients = [row.gradient_pa_m for row in TABLE_1]
    pairs = list(pairwise(gradients))
    slow = law.slow_gradients()
    ends = [*pairs, slow]
    free = [number(law.free_flight_exponent(*pair), 2) for pair in ends]
    rows = [["law", *["1"] * len(ends)], ["free flight", *free]]
    for section in SECTIONS:
        printed = [printed_exponent(*pair, section) for pair in ends]
        rows.append([f"DEM, printed, {section}", *printed])
    for series in (MAIN, PRINTED, FOLLOWS, VISCOUS):
        for section in SECTIONS:
            flows = flows_by_gradient(stored, series, section)
            local = local_exponents(flows)
            planned = by_gradient(stored, series)
            wanted = [pair if set(pair) <= set(planned) else None for pair in pairs]
            own = [_exponent_cell(local, flows, pair) for pair in wanted]
            overall = exponent(flows, fitted(series))
            last = NONE if overall is None and len(flows) > 1 else short_cell(overall)
            rows.append([f"{series.name}, {section}", *own, last])
    heads = [f"{low:g} to {high:g} Pa/m" for low, high in pairs]
    return table(["", *heads, "fitted"], rows)


def _exponent_cell(
    local: Mapping[tuple[float, float], Pooled],
    flows: Mapping[float, Pooled],
    pair: tuple[float, float] | None,
) -> str:
    """An exponent; a dash where it is not wanted, or both ran and nothing flows at one of them."""
    if pair is not None and any(g in flows and flows[g].rising for g in pair):
        return _RISES
    if pair is None or (pair not in local and set(pair) <= set(flows)):
        return NONE
    return short_cell(local.get(pair))


def printed_exponent(low: float, high: float, section: str) -> str:
    """The power of the gradient of the paper's simulated flow rates between two gradients."""
    ratio = ROWS[high].flow_m3_s(section) / ROWS[low].flow_m3_s(section)
    return number(float(np.log(ratio) / np.log(high / low)), 2)


def validity_table(stored: Stored) -> str:
    """The simulated flow over the law's at every gradient."""
    flows = {s: flows_by_gradient(stored, ALL_GRADIENTS, s) for s in SECTIONS}
    rows = []
    for gradient, points in by_gradient(stored, ALL_GRADIENTS).items():
        law_flow, reynolds = law.law_flow_m3_s(gradient), law.law_reynolds(gradient)
        valid = "yes" if law.is_slow(gradient) else "no"
        ratios = [cell(flows[s].get(gradient), law_flow, missing(points)) for s in SECTIONS]
        rows.append(
            [f"{gradient:g}", number(reynolds), valid, number(law_flow / FLOW_UNIT), *ratios]
        )
    heads = ["Pa/m", "Re", "law said to hold", "law, 10⁻⁶ m³/s"]
    return table([*heads, *(f"{section}, over the law" for section in SECTIONS)], rows)


def runs_table(stored: Stored) -> str:
    """How many points of each sweep have an answer, and what becomes of the others."""
    rows = []
    for sweep in stored.sweeps.values():
        verdicts = Counter(p.answer.verdict for p in sweep.points if p.answer is not None)
        waiting = Counter(p.why for p in sweep.points if p.state == "unfinished")
        failed = sum(point.state == "failed" for point in sweep.points)
        told = [f"{count} {name.replace('_', ' ')}" for name, count in sorted(verdicts.items())]
        told += [f"{failed} failed"] if failed else []
        told += [f"{count} {why}" for why, count in sorted(waiting.items())]
        rows.append([f"`{sweep.name}.toml`", sweep.title, str(len(sweep.points)), ", ".join(told)])
    return table(["sweep in `cases/paper/`", "what it is", "points", "of these"], rows)
