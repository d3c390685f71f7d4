"""Whether any reading of the paper gives its flow rates at 10 Pa/m."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from liggghts_driver.paper.catalogue import AS_PRINTED, FIRST, READINGS
from liggghts_driver.paper.pooled import answers_of, flow, missing, of_reading
from liggghts_driver.paper.printed import MAIN_GRADIENT_PA_M, ROWS, SECTIONS
from liggghts_driver.paper.steadiness import steady_words
from liggghts_driver.paper.words import FLOW_UNIT, by_kind, capital, judge, listed
from liggghts_driver.report.numbers import number

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from liggghts_driver.paper.catalogue import Reading
    from liggghts_driver.paper.pooled import Pooled
    from liggghts_driver.paper.stored import Stored
    from liggghts_driver.paper.words import Judgement, Verdict


@dataclass(frozen=True)
class _Held:
    """A reading held against the paper at 10 Pa/m: flow rates and judgements, by section.

    Both are empty where it has no flow rate; ``without`` says why.
    """

    reading: Reading
    flows: Mapping[str, Pooled]
    judged: Mapping[str, Judgement]
    without: str = ""

    @property
    def title(self) -> str:
        """What the reading is called, set off from the words around it."""
        return f"*{self.reading.title}*"

    @property
    def kinds(self) -> set[str]:
        """How its sections were judged."""
        return {each.kind for each in self.judged.values()}

    @property
    def verdict(self) -> Verdict:
        """Whether it gives the paper's flow rates; several packings are needed to say so."""
        if not self.judged:
            return "not run yet"
        if self.kinds == {"agrees"}:
            return "yes"
        return "no" if "differs" in self.kinds else "not decided"


def reading_answer(stored: Stored) -> list[str]:
    """Whether any reading gives the paper's flow rates at 10 Pa/m: a verdict, and what is left."""
    held = [_held(stored, reading) for reading in READINGS]
    ran = [each for each in held if each.judged]
    if not ran:
        return [f"{capital(held[0].without)}."]
    sentences = [_verdict(held) + _bracket(held), *_second_outside(stored)]
    for why in sorted({each.without for each in held if not each.judged}):
        without = [each.title for each in held if each.without == why]
        sentences.append(f"{capital(why)}: {listed(without)}.")
    return sentences


def reading_verdicts(stored: Stored) -> dict[str, Verdict]:
    """Whether it gives the paper's flow rates, for each reading that the paper may mean."""
    held = [_held(stored, reading) for reading in READINGS if not reading.control]
    return {each.title: each.verdict for each in held}


def _held(stored: Stored, reading: Reading) -> _Held:
    points = of_reading(stored, reading)
    found = {name: flow(points, name) for name in SECTIONS}
    flows = {name: pooled for name, pooled in found.items() if pooled is not None}
    if len(flows) < len(SECTIONS):
        return _Held(reading, {}, {}, missing(points))
    judged = {s: judge(flows[s], _printed(s), FLOW_UNIT) for s in flows}
    return _Held(reading, flows, judged)


def _printed(section: str) -> float:
    """The paper's simulated flow rate at 10 Pa/m [m3/s]."""
    return ROWS[MAIN_GRADIENT_PA_M].flow_m3_s(section)


def _verdict(held: Sequence[_Held]) -> str:
    """The verdict in words: which readings agree, which do not, and of which it is not known."""
    entrance, middle = (number(_printed(name) / FLOW_UNIT) for name in SECTIONS)
    readings = [each for each in held if not each.reading.control]
    kinds: dict[str, list[str]] = {kind: [] for kind in ("yes", "no", "not decided", "one", "none")}
    for each in readings:
        single = "one packing" in each.kinds
        kinds["one" if single else each.verdict if each.judged else "none"].append(each.title)
    start = "Yes" if kinds["yes"] else "No" if len(kinds["no"]) == len(readings) else "Not decided"
    told = {
        "yes": "both sections agree in",
        "no": "one or both differ in",
        "not decided": "it is not told in",
        "one": "one packing alone has",
        "none": "there is no flow rate yet of",
    }
    return (
        f"{start}: over the second half, held against {entrance} at the entrance and {middle} at "
        f"the middle, {by_kind(told, kinds)}.{_at_the_entrance(readings)}"
    )


def _at_the_entrance(readings: Sequence[_Held]) -> str:
    """Readings of which the entrance alone agrees."""
    alone = [
        each.title
        for each in readings
        if each.judged and each.judged["entrance"].agrees and each.verdict != "yes"
    ]
    return f" At the entrance alone {listed(alone)} would agree." if alone else ""


def _bracket(held: Sequence[_Held]) -> str:
    """Whether the paper lies between the two readings of the outside fluid, at both sections."""
    two = [each for each in held if each.reading in (FIRST, AS_PRINTED) and each.judged]
    if len(two) < 2 or any("one packing" in each.kinds for each in two):
        return ""
    told = []
    for name in SECTIONS:
        low, high = sorted(each.flows[name].mean for each in two)
        if not low <= _printed(name) <= high:
            return ""
        between = f"{number(low / FLOW_UNIT)} to {number(high / FLOW_UNIT)}"
        told.append(f"{name}, {between} around {number(_printed(name) / FLOW_UNIT)}")
    titles = listed([each.title for each in two])
    return (
        f" The paper lies between the two readings of the outside fluid, {titles}: "
        f"{'; '.join(told)}."
    )


def _second_outside(stored: Stored) -> list[str]:
    """Whether the flow is steady with the outside fluid as printed."""
    points = of_reading(stored, AS_PRINTED)
    told = [f"{name}, {steady_words(points, name)}" for name in SECTIONS]
    words = f"*{AS_PRINTED.title}*, over the second half: {'; '.join(told)}."
    return [words] if answers_of(points) else []
