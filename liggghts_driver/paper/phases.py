"""The phases of a run at 10 Pa/m: the piston falls, meets the dense bed and bounces, and creeps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.paper.catalogue import MAIN
from liggghts_driver.paper.pooled import answers_of, at_ten, missing
from liggghts_driver.paper.printed import SECTIONS
from liggghts_driver.paper.words import FLOW_UNIT, capital, listed, reach
from liggghts_driver.report.numbers import number

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from liggghts_driver.paper.stored import Curves, Stored


@dataclass(frozen=True)
class Bounce:
    """The piston and the bed in one run.

    Attributes
    ----------
    met, turned, returned
        The samples at which the piston goes back, forth again, and from which it is farther than
        when it met the bed; the last sample if it never is.
    back_m
        How far it goes back between them.
    """

    met: int
    turned: int
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
    turned = met + int(np.argmin(places_m[met : returned + 1]))
    return Bounce(met, turned, returned, float(places_m[met] - places_m[turned]))


def phases_answer(stored: Stored) -> list[str]:
    """What happens one after the other in the first reading, with numbers of all packings."""
    points = at_ten(stored, MAIN)
    several = [answer.curves for answer in answers_of(points).values()]
    found = [(curves, bounce) for curves in several if (bounce := bounce_of(curves)) is not None]
    if not found:
        return [] if several else [f"{capital(missing(points))}."]
    return [_entry(found), _standstill(found), _creep(several)]


def _entry(found: Sequence[tuple[Curves, Bounce]]) -> str:
    met = [bounce.met * curves.interval_s for curves, bounce in found]
    fastest = [
        1e-3 * float(np.diff(c.piston_x_um[: b.met + 1]).max()) / c.interval_s for c, b in found
    ]
    entered = [1e6 * curves.passed_m3("entrance", 0, bounce.met) for curves, bounce in found]
    return (
        f"*Entry*, to {reach(met)} s: the piston falls, at last with {reach(fastest)} mm/s, and "
        f"{reach(entered)} cm³ of particles enter; the others pile up before the entrance."
    )


def _standstill(found: Sequence[tuple[Curves, Bounce]]) -> str:
    returned = [bounce.returned * curves.interval_s for curves, bounce in found]
    back = [1e3 * bounce.back_m for _, bounce in found]
    backwards = [1e6 * c.passed_m3("entrance", b.met, b.turned) for c, b in found]
    forwards = [1e6 * c.passed_m3("entrance", b.turned, b.returned) for c, b in found]
    return (
        f"*Standstill*, to {reach(returned)} s: the piston meets the dense bed and bounces back "
        f"by {reach(back)} mm. While it goes back, its fluid with it, a net {reach(backwards)} cm³ "
        f"enter, although the gradient acts inside; as it comes forth again, {reach(forwards)}. "
        "(In *v_f = a t* the piston bounces too, and the flow goes on: it is the fluid that holds "
        "the particles back.)"
    )


def _creep(several: Sequence[Curves]) -> str:
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
        f"*Creep*, to the end: the piston creeps at {reach(speeds)} mm/s over the second half; "
        "the flow rates in the third and the fourth quarter of the run are "
        f"{listed(told)}, in 10⁻⁶ m³/s."
    )


def _mean(rates_m3_s: Iterable[float]) -> str:
    return number(float(np.mean(list(rates_m3_s))) / FLOW_UNIT)
