"""The phases of a run at 10 Pa/m: the piston falls, meets the dense bed and bounces, and creeps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.paper import law
from liggghts_driver.paper.catalogue import MAIN
from liggghts_driver.paper.pooled import answers_of, at_ten, missing
from liggghts_driver.paper.printed import SECTIONS
from liggghts_driver.paper.words import FLOW_UNIT, capital, listed
from liggghts_driver.report.numbers import number

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from liggghts_driver.paper.stored import Curves, Stored


@dataclass(frozen=True)
class Bounce:
    """The piston and the bed in one run.

    Attributes
    ----------
    met, returned
        The samples at which the piston turns back, and from which it is farther than there again;
        the last sample if it never is.
    back_m
        How far it goes back between them.
    """

    met: int
    returned: int
    back_m: float


def bounce_of(curves: Curves) -> Bounce | None:
    """When the piston first goes back; None where it never does."""
    places_m = 1e-6 * np.array(curves.piston_x_um, dtype=np.float64)
    backwards = np.flatnonzero(np.diff(places_m) < 0.0)
    if not len(backwards):
        return None
    met = int(backwards[0])
    beyond = np.flatnonzero(places_m[met + 1 :] > places_m[met])
    returned = met + 1 + int(beyond[0]) if len(beyond) else len(places_m) - 1
    return Bounce(met, returned, float(places_m[met] - places_m[met : returned + 1].min()))


def phases_answer(stored: Stored) -> list[str]:
    """What happens one after the other in the first reading, with numbers of all packings."""
    points = at_ten(stored, MAIN)
    several = [answer.curves for answer in answers_of(points).values()]
    found = [(curves, bounce) for curves in several if (bounce := bounce_of(curves)) is not None]
    if not found:
        return [] if several else [f"{capital(missing(points))}."]
    return [_entry(found), _standstill(found), _decay(several)]


def _entry(found: Sequence[tuple[Curves, Bounce]]) -> str:
    piston = law.example().piston
    assert piston is not None
    met = [bounce.met * curves.interval_s for curves, bounce in found]
    speed = piston.acceleration * float(np.mean(met))
    entered = [1e6 * curves.passed_m3("entrance", 0, bounce.met) for curves, bounce in found]
    return (
        f"*Entry*, to {_reach(met)} s: the piston falls almost freely, to about a t = "
        f"{number(1e3 * speed, 2)} mm/s, and {_reach(entered)} cm³ of particles enter; the others "
        "pile up before the entrance."
    )


def _standstill(found: Sequence[tuple[Curves, Bounce]]) -> str:
    returned = [bounce.returned * curves.interval_s for curves, bounce in found]
    back = [1e3 * bounce.back_m for _, bounce in found]
    entered = [1e6 * c.passed_m3("entrance", b.met, b.returned) for c, b in found]
    return (
        f"*Standstill*, to {_reach(returned)} s: the piston meets the dense bed and bounces back "
        f"by {_reach(back)} mm. Its fluid goes back with it, and {_reach(entered)} cm³ enter in "
        "that time, although the gradient acts inside all the while. (In *v_f = a t* the piston "
        "bounces too, and the flow goes on: it is the fluid that holds the particles back.)"
    )


def _decay(several: Sequence[Curves]) -> str:
    """The second half, and the rates of both sections in its first and in its last quarter."""
    halves = [(curves, *curves.quarters()) for curves in several]
    speeds = [
        1e-3 * (c.piston_x_um[-1] - c.piston_x_um[half]) / (c.end_s - half * c.interval_s)
        for c, half, _ in halves
    ]
    told = []
    for name in SECTIONS:
        earlier = _mean(c.rate_m3_s(name, half, three) for c, half, three in halves)
        later = _mean(c.rate_m3_s(name, three) for c, _, three in halves)
        told.append(f"{earlier} and {later} past the {name}")
    return (
        f"*Decay*, to the end: the piston creeps at {_reach(speeds)} mm/s over the second half; "
        "the flow rates in the third and the fourth quarter of the run are "
        f"{listed(told)}, in 10⁻⁶ m³/s."
    )


def _mean(rates_m3_s: Iterable[float]) -> str:
    return number(float(np.mean(list(rates_m3_s))) / FLOW_UNIT)


def _reach(values: Sequence[float]) -> str:
    """One number where all are the same to two digits, else from the smallest to the largest."""
    low, high = number(min(values), 2), number(max(values), 2)
    return low if low == high else f"{low} to {high}"
