"""What if: simulated flow rates beside the law's, where an input of the law was varied in both."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.paper.changes import change_between, change_words, exact_words
from liggghts_driver.paper.printed import SECTIONS
from liggghts_driver.paper.stored import NOT_RUN
from liggghts_driver.paper.varied import FRACTION, POROSITY
from liggghts_driver.paper.words import FLOW_UNIT, capital, cell, judge, listed

if TYPE_CHECKING:
    from collections.abc import Iterable

    from liggghts_driver.darcy import Estimate
    from liggghts_driver.paper.stored import Stored
    from liggghts_driver.paper.varied import Varied
    from liggghts_driver.studies.paired import Change


def what_if_answer(stored: Stored) -> list[str]:
    """A sentence for each value of each input that has been simulated."""
    sentences = [
        _beside_the_law(stored, varied, value)
        for varied in (FRACTION, POROSITY)
        for value in sorted(set().union(*(varied.flows(stored, s) for s in SECTIONS)))
    ]
    sentences += [_from_first_to_last(stored, varied) for varied in (FRACTION, POROSITY)]
    return [each for each in sentences if each] or [f"{capital(NOT_RUN)}."]


def _from_first_to_last(stored: Stored, varied: Varied) -> str:
    """What an input changes from its smallest to its largest value: of our flows, and the law's."""
    changes, found = {}, {name: varied.flows(stored, name) for name in SECTIONS}
    for name, flows in found.items():
        if len(flows) > 1:
            low, high = min(flows), max(flows)
            changes[name] = change_between(flows[high], flows[low])
    known = {name: change for name, change in changes.items() if change is not None}
    if not known:
        return ""
    theirs = _law_m3_s(varied.estimate(high)) / _law_m3_s(varied.estimate(low)) - 1.0
    told = [f"past the {name} by {change_words(change)}" for name, change in known.items()]
    return (
        f"From {varied.symbol} = {low:g} to {high:g} the flow rate changes {listed(told)}, the "
        f"law's by {exact_words(theirs)}"
        f"{_another_course(known.values(), theirs)}."
    )


def _another_course(changes: Iterable[Change], theirs: float) -> str:
    """Whether that is another change than the law's, past each section."""
    told = [c.ci95 is not None and abs(c.mean - theirs) > c.ci95 for c in changes]
    return ": another course, and where one value agrees the two cross" if all(told) else ""


def _law_m3_s(estimated: Estimate) -> float:
    return float(np.asarray(estimated.particle_flow_rate_m3_s))


def _beside_the_law(stored: Stored, varied: Varied, value: float) -> str:
    law_at = varied.estimate(value)
    expected = _law_m3_s(law_at)
    outside = "" if law_at.valid else ", where it is said not to hold"
    told = []
    for section in SECTIONS:
        pooled = varied.flows(stored, section).get(value)
        judged = judge(pooled, expected, FLOW_UNIT).words
        told.append(f"{section}, {cell(pooled, FLOW_UNIT)}, {judged}")
    return f"{varied.symbol} = {value:g}, held against the law{outside}: {'; '.join(told)}."
