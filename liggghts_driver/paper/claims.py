"""The paper's claims on its simulations, each with what ours give and whether it holds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from liggghts_driver.paper.agreement import velocity_sides, velocity_words
from liggghts_driver.paper.catalogue import FOLLOWS, TABLE_READINGS
from liggghts_driver.paper.friction import obstruction
from liggghts_driver.paper.pooled import (
    answers_of,
    at_ten,
    flow,
    flows_by_gradient,
    missing,
    of_series,
)
from liggghts_driver.paper.power import kind_of_power, no_power, power_of
from liggghts_driver.paper.printed import MAIN_GRADIENT_PA_M, ROWS, SECTIONS, STEADY_FROM_S
from liggghts_driver.paper.steadiness import first_arrival
from liggghts_driver.paper.stored import NOT_RUN
from liggghts_driver.paper.validity import course_of, sides_words
from liggghts_driver.paper.verdict import reading_verdicts
from liggghts_driver.paper.windows import steady_since
from liggghts_driver.paper.words import FLOW_UNIT, any_of, counted, listed, short_cell
from liggghts_driver.report.numbers import number

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from liggghts_driver.paper.agreement import Side
    from liggghts_driver.paper.catalogue import Series
    from liggghts_driver.paper.power import PowerKind
    from liggghts_driver.paper.stored import Stored
    from liggghts_driver.paper.validity import Course
    from liggghts_driver.paper.words import Verdict

    #: What a reading gives, in words, and whether it bears the claim out.
    Finding = tuple[str, Verdict]

_OF_POWER: dict[PowerKind, Verdict] = {
    "proportional": "yes", "other": "no", "not told": "not decided", "one packing": "not decided",
}  # fmt: skip
_OF_COURSE: dict[Course, Verdict] = {
    "followed": "yes", "farther": "in part", "left": "no", "not told": "not decided",
}  # fmt: skip
_OF_SIDE: dict[Side, Verdict] = {
    "within it": "yes", "overlapping it": "in part", "above it with all counted": "no",
    # Another choice of what counts as flowing would move these.
    "below it": "not decided", "above it": "not decided", "one packing": "not decided",
}  # fmt: skip
#: What is said of one reading, and of several.
_COUNTED: dict[Verdict, tuple[str, str]] = {
    "yes": ("agrees", "agree"),
    "no": ("differs", "differ"),
    "not decided": ("is not decided", "are not decided"),
    "not run yet": ("has not run", "have not run"),
}


@dataclass(frozen=True)
class Claim:
    """What the paper says, what our runs give, and whether some reading of the paper bears it out.

    One reading that does is enough; "no" takes all readings, each with several packings.
    """

    words: str
    found: str
    verdict: Verdict


def claims(stored: Stored) -> list[Claim]:
    """The claims that the runs can judge."""
    ten, steady_from = f"At {MAIN_GRADIENT_PA_M:g} Pa/m", f"{STEADY_FROM_S:g} s"
    asked = [number(ROWS[MAIN_GRADIENT_PA_M].flow_m3_s(name) / FLOW_UNIT) for name in SECTIONS]
    where = listed(SECTIONS)
    return [
        _flows(stored, f"{ten} {listed(asked)} × 10⁻⁶ m³/s of particles pass {where}"),
        _of(stored, f"{ten} both flows are steady from about {steady_from} on", _steady),
        _of(
            stored,
            f"Up to {MAIN_GRADIENT_PA_M:g} Pa/m the flow rate goes with the gradient (power 1)",
            _power,
            (*TABLE_READINGS, FOLLOWS),
        ),
        _of(stored, "The law gives the flow rate up to Re of about 10, and not beyond", _law),
        _of(
            stored,
            "The velocity of the flowing particles is within the ranges of Table 1",
            _velocity,
        ),
        Claim("Friction may obstruct the entrance completely", *obstruction(stored)),
    ]


def _of(
    stored: Stored,
    words: str,
    finds: Callable[[Stored, Series], Finding],
    several: Iterable[Series] = TABLE_READINGS,
) -> Claim:
    """A claim held against several readings."""
    found = {series.name: finds(stored, series) for series in several}
    told = "; ".join(f"{name}: {words}" for name, (words, _) in found.items())
    return Claim(words, told, any_of(verdict for _, verdict in found.values()))


def _flows(stored: Stored, words: str) -> Claim:
    """Those of the readings of the outside fluid are told, of the others how many agree."""
    told = []
    for series in TABLE_READINGS:
        points = at_ten(stored, series)
        rates = [short_cell(flow(points, s), FLOW_UNIT, missing(points)) for s in SECTIONS]
        told.append(f"{series.name}: {' and '.join(dict.fromkeys(rates))}")
    verdicts = reading_verdicts(stored)
    told.append(f"of {counted(len(verdicts), 'reading')}, {_how_many(verdicts)}")
    return Claim(words, "; ".join(told), any_of(verdicts.values()))


def _how_many(verdicts: Mapping[str, Verdict]) -> str:
    """How many readings agree, how many differ; those that do not differ by name."""
    parts = []
    for verdict, (one, more) in _COUNTED.items():
        titles = [title for title, found in verdicts.items() if found == verdict]
        names = f" ({listed(titles)})" if verdict in ("yes", "not decided") else ""
        if titles:
            parts.append(f"{len(titles)} {one if len(titles) == 1 else more}{names}")
    return listed(parts)


def _steady(stored: Stored, series: Series) -> Finding:
    """Whether both flows are, from the paper's instant to the end of the run."""
    points = at_ten(stored, series)
    answers = list(answers_of(points).values())
    if not answers:
        return missing(points), "not run yet"
    counts = {s: sum(steady_since(a, s, STEADY_FROM_S) for a in answers) for s in SECTIONS}
    told = listed([f"in {count} at the {name}" for name, count in counts.items()])
    words = (
        f"of {counted(len(answers), 'packing')}, steady from then on {told}; the first particle "
        f"passes the middle {first_arrival(answers)}"
    )
    if len(answers) < 2:
        return words, "not decided"
    if set(counts.values()) == {len(answers)}:
        return words, "yes"
    return words, "no" if 0 in counts.values() else "in part"


def _power(stored: Stored, series: Series) -> Finding:
    """Whether the flow goes with the gradient, past both sections."""
    powers = {name: power_of(stored, series, name) for name in SECTIONS}
    known = {name: power for name, power in powers.items() if power is not None}
    if not known:
        words = no_power(stored, series)
        return words, "not run yet" if words == NOT_RUN else "not decided"
    kinds = [kind_of_power(power) for power in known.values()]
    words = listed([f"{short_cell(power)} at the {name}" for name, power in known.items()])
    return f"power {words}", _both(_OF_POWER[kind] for kind in kinds)


def _law(stored: Stored, series: Series) -> Finding:
    """Whether the flow follows the law's line as far as it is said to, past both sections."""
    several = {name: flows_by_gradient(stored, series, name) for name in SECTIONS}
    known = {name: flows for name, flows in several.items() if flows}
    if not known:
        return missing(of_series(stored, series)), "not run yet"
    words = listed([f"{name}, {sides_words(flows)}" for name, flows in known.items()])
    return words, _both(_OF_COURSE[course_of(flows)] for flows in known.values())


def _velocity(stored: Stored, series: Series) -> Finding:
    """Whether the mean velocity is in the paper's range at its gradients."""
    sides = velocity_sides(stored, series)
    if not sides:
        return missing(of_series(stored, series)), "not run yet"
    verdicts = {_OF_SIDE[side] for side in sides}
    # Where even all are too fast at one gradient, no choice of what counts brings all in range.
    missed = "no" in verdicts and "yes" not in verdicts
    return velocity_words(sides), "no" if missed else _both(verdicts)


def _both(verdicts: Iterable[Verdict]) -> Verdict:
    """What holds past both sections, or at all gradients: a part of it only is "in part"."""
    found = set(verdicts)
    if len(found) == 1:
        return found.pop()
    if "no" in found:
        return "in part" if {"yes", "in part"} & found else "no"
    return "not decided"
