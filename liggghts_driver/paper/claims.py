"""The paper's claims on its simulations, each with what ours give and whether it holds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from liggghts_driver.paper.agreement import (
    AS_THE_PAPER,
    NOT_AS_THE_PAPER,
    velocity_kinds,
    velocity_words,
)
from liggghts_driver.paper.answers import (
    FLOW_UNIT,
    SECTIONS,
    kind_of_power,
    power_of,
    steady_count,
)
from liggghts_driver.paper.catalogue import FRICTIONS, MAIN, TABLE_READINGS
from liggghts_driver.paper.explain import change_of, change_words, is_stopped
from liggghts_driver.paper.pooled import by_gradient, flow, flows_by_gradient
from liggghts_driver.paper.printed import MAIN_GRADIENT_PA_M, ROWS, STEADY_FROM_S
from liggghts_driver.paper.validity import follows_the_law, sides_words
from liggghts_driver.paper.verdict import reading_verdict
from liggghts_driver.paper.words import NOT_RUN, counted, listed, short_cell
from liggghts_driver.report.numbers import number

if TYPE_CHECKING:
    from collections.abc import Iterable

    from liggghts_driver.paper.stored import Stored
    from liggghts_driver.paper.words import Verdict


@dataclass(frozen=True)
class Claim:
    """What the paper says, what our runs give, and whether what it says holds for them."""

    words: str
    found: str
    verdict: Verdict


def claims(stored: Stored) -> list[Claim]:
    """The claims that the runs can judge."""
    return [
        _flows(stored),
        _steady(stored),
        _power(stored),
        _law(stored),
        _velocities(stored),
        _friction(stored),
    ]


def _flows(stored: Stored) -> Claim:
    printed = ROWS[MAIN_GRADIENT_PA_M]
    asked = listed([number(printed.flow_m3_s(name) / FLOW_UNIT) for name in SECTIONS])
    told = []
    for series in TABLE_READINGS:
        points = by_gradient(stored, series).get(MAIN_GRADIENT_PA_M, [])
        rates = [short_cell(flow(points, name), FLOW_UNIT) for name in SECTIONS]
        told.append(f"{series.name}: {listed(rates)}")
    return Claim(
        f"At {MAIN_GRADIENT_PA_M:g} Pa/m {asked} × 10⁻⁶ m³/s of particles pass {listed(SECTIONS)}",
        "; ".join(told),
        reading_verdict(stored),
    )


def _steady(stored: Stored) -> Claim:
    when = f"from about {STEADY_FROM_S:g} s on"
    words = f"At {MAIN_GRADIENT_PA_M:g} Pa/m both flows are steady {when}"
    points = by_gradient(stored, MAIN).get(MAIN_GRADIENT_PA_M, [])
    answers = [p.sound for p in points if p.sound is not None]
    if not answers:
        return Claim(words, NOT_RUN, "not run yet")
    counts = {name: steady_count(answers, name) for name in SECTIONS}
    times = [a.reached_s["middle"] for a in answers]
    early = [time_s is not None and time_s < STEADY_FROM_S for time_s in times]
    known = [time_s for time_s in times if time_s is not None]
    first = f"after {number(min(known))} s" if known else "not within the run"
    told = listed([f"in {count} at the {name}" for name, count in counts.items()])
    found = (
        f"of {counted(len(answers), 'packing')}, over the second half, steady {told}; "
        f"the first particle passes the middle {first}"
    )
    if len(answers) < 2:
        return Claim(words, found, "not decided")
    everywhere = all(early) and set(counts.values()) == {len(answers)}
    nowhere = not any(early) or 0 in counts.values()
    return Claim(words, found, "yes" if everywhere else "no" if nowhere else "in part")


def _power(stored: Stored) -> Claim:
    told, kinds = [], []
    for series in TABLE_READINGS:
        powers = {name: power_of(stored, series, name) for name in SECTIONS}
        words = listed([f"{short_cell(p)} at the {name}" for name, p in powers.items() if p])
        told.append(f"{series.name}: power {words}" if words else f"{series.name}: {NOT_RUN}")
        kinds += [kind_of_power(p) for p in powers.values() if p is not None]
    return Claim(
        f"Up to {MAIN_GRADIENT_PA_M:g} Pa/m the flow rate goes with the gradient (power 1)",
        "; ".join(told),
        _all_of(kinds, yes={"proportional"}, no={"other"}),
    )


def _law(stored: Stored) -> Claim:
    told, kinds = [], []
    for name in SECTIONS:
        flows = flows_by_gradient(stored, MAIN, name)
        told.append(f"{name}: {sides_words(flows)}" if flows else f"{name}: {NOT_RUN}")
        if flows:
            kinds.append(follows_the_law(flows))
    return Claim(
        "The law gives the flow rate up to Re of about 10, between 10 and 20 Pa/m",
        "; ".join(told),
        _all_of(kinds, yes={"followed"}, no={"left"}),
    )


def _velocities(stored: Stored) -> Claim:
    told, kinds = [], []
    for series in TABLE_READINGS:
        found = velocity_kinds(stored, series)
        told.append(f"{series.name}: {velocity_words(found) or NOT_RUN}")
        kinds += [kind for kind, some in found.items() for _ in some]
    return Claim(
        "The mean velocity of the flowing particles is within the ranges of Table 1",
        "; ".join(told),
        _all_of(kinds, yes=set(AS_THE_PAPER), no=set(NOT_AS_THE_PAPER)),
    )


def _friction(stored: Stored) -> Claim:
    changes = {each.title: change_of(stored, each, "entrance") for each in FRICTIONS}
    known = {title: change for title, change in changes.items() if change is not None}
    kinds = [
        "one packing" if change.ci95 is None else "stopped" if is_stopped(change) else "flows"
        for change in known.values()
    ]
    told = [f"{title}: {change_words(change)}" for title, change in known.items()]
    return Claim(
        "Friction may obstruct the entrance",
        "; ".join(told) or NOT_RUN,
        "yes" if "stopped" in kinds else _all_of(kinds, yes=set(), no={"flows"}),
    )


def _all_of(kinds: Iterable[str], yes: set[str], no: set[str]) -> Verdict:
    """What several findings make together; what is of neither kind decides nothing."""
    found = list(kinds)
    if not found:
        return "not run yet"
    for_it, against = (sum(kind in some for kind in found) for some in (yes, no))
    if for_it and against:
        return "in part"
    if against:
        return "no"
    return "yes" if for_it == len(found) else "not decided"
