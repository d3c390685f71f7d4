"""Whether any reading of the paper gives its flow rates at 10 Pa/m."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from liggghts_driver.paper.answers import FLOW_UNIT, SECTIONS, steady_words
from liggghts_driver.paper.catalogue import READINGS
from liggghts_driver.paper.pooled import flow, of_reading
from liggghts_driver.paper.printed import MAIN_GRADIENT_PA_M, ROWS
from liggghts_driver.paper.words import NOT_RUN, capital, cell, judge, listed
from liggghts_driver.report.numbers import number

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from liggghts_driver.paper.pooled import Pooled
    from liggghts_driver.paper.stored import Stored
    from liggghts_driver.paper.words import Judgement, Verdict


@dataclass(frozen=True)
class _Held:
    """A reading held against the paper at 10 Pa/m: flow rates and judgements, by section."""

    title: str
    flows: Mapping[str, Pooled]
    judged: Mapping[str, Judgement]

    @property
    def kinds(self) -> set[str]:
        """How its sections were judged."""
        return {each.kind for each in self.judged.values()}


def reading_answer(stored: Stored) -> list[str]:
    """Whether any reading gives the paper's flow rates at 10 Pa/m: a verdict, then each."""
    held = _held(stored)
    titles = [each.title for each in held]
    missing = [reading.title for reading in READINGS if reading.title not in titles]
    sentences = [_verdict(held) + _bracket(held), *_second_outside(stored)]
    sentences += [
        f"{capital(each.title)}: "
        + "; ".join(
            f"{name}, {cell(each.flows[name], FLOW_UNIT)}: {each.judged[name].words}"
            for name in SECTIONS
        )
        + "."
        for each in held
    ]
    if missing:
        sentences.append(f"{capital(NOT_RUN)}: {listed(missing)}.")
    return sentences


def reading_verdict(stored: Stored) -> Verdict:
    """The same in a word or two."""
    return _kind(_held(stored))


def _held(stored: Stored) -> list[_Held]:
    """The readings that have run."""
    held = []
    for reading in READINGS:
        points = of_reading(stored, reading)
        found = {name: flow(points, name) for name in SECTIONS}
        flows = {name: pooled for name, pooled in found.items() if pooled is not None}
        judged = {s: judge(flows[s], _printed(s), FLOW_UNIT) for s in flows}
        if len(flows) == len(SECTIONS):
            held.append(_Held(reading.title, flows, judged))
    return held


def _kind(held: Sequence[_Held]) -> Verdict:
    """What the readings with several packings say; one packing decides nothing."""
    several = [each.kinds for each in held if "one packing" not in each.kinds]
    if not held:
        return "not run yet"
    if {"agrees"} in several:
        return "yes"
    undecided = not several or any("differs" not in kinds for kinds in several)
    return "not decided" if undecided else "no"


def _printed(section: str) -> float:
    """The paper's simulated flow rate at 10 Pa/m [m3/s]."""
    return ROWS[MAIN_GRADIENT_PA_M].flow_m3_s(section)


def _verdict(held: Sequence[_Held]) -> str:
    """The verdict in words; readings with one packing are named."""
    kind = _kind(held)
    if kind == "not run yet":
        return f"{capital(NOT_RUN)}."
    entrance, middle = (number(_printed(name) / FLOW_UNIT) for name in SECTIONS)
    asked = f"{entrance} at the entrance and {middle} at the middle"
    several = [each for each in held if "one packing" not in each.kinds]
    single = [each.title for each in held if "one packing" in each.kinds]
    both = [each.title for each in several if each.kinds == {"agrees"}]
    may = [each.title for each in several if "differs" not in each.kinds]
    first = [each.title for each in several if each.judged["entrance"].agrees]
    if kind == "yes":
        told = f"Yes: over the second half {listed(both)} agrees with {asked}."
    elif kind == "not decided":
        which = f"{listed(may)} may agree with" if may else "no reading with several packings has"
        told = f"Not decided: over the second half {which} {asked}."
    else:
        alone = f"; at the entrance alone {listed(first)} agrees" if first else ""
        told = (
            "No: over the second half no reading that ran with several packings "
            f"({listed([each.title for each in several])}) agrees with {asked}{alone}."
        )
    if single:
        told += f" One packing, which decides nothing: {listed(single)}."
    return told


def _bracket(held: Sequence[_Held]) -> str:
    """Whether the paper lies between the two readings of the outside fluid, at both sections."""
    titles = [reading.title for reading in READINGS[:2]]
    two = [each for each in held if each.title in titles]
    if len(two) < len(titles):
        return ""
    told = []
    for name in SECTIONS:
        low, high = sorted(each.flows[name].mean for each in two)
        if not low <= _printed(name) <= high:
            return ""
        between = f"{number(low / FLOW_UNIT)} to {number(high / FLOW_UNIT)}"
        told.append(f"{name}, {between} around {number(_printed(name) / FLOW_UNIT)}")
    return (
        f" The paper lies between the two readings of the outside fluid, {listed(titles)}: "
        f"{'; '.join(told)}."
    )


def _second_outside(stored: Stored) -> list[str]:
    """Whether the flow is steady with the outside fluid as printed."""
    points = [p for p in of_reading(stored, READINGS[1]) if p.sound]
    told = [f"{name}, {steady_words(points, name)}" for name in SECTIONS]
    words = f"{capital(READINGS[1].title)}, over the second half: {'; '.join(told)}."
    return [words] if points else []
