"""What must hold in every run, whatever it simulates: invariants, worst values and limits."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.effects.drag_law import reynolds_bound
from liggghts_driver.effects.piston import speed_limit_m_s
from liggghts_driver.effects.rotation import Rotation
from liggghts_driver.results.plain import number_or_nan
from liggghts_driver.results.series import fastest_piston_m_s
from liggghts_driver.results.verdict import SHARE_OF_LIMIT
from liggghts_driver.studies.energy import (
    drag_given_j,
    drag_taken_j,
    elastic_j,
    kinetic_j,
    spin_j,
    work_j,
)
from liggghts_driver.studies.growth import growth_from_start, growth_in_windows
from liggghts_driver.studies.piston_flight import FEWEST_STEPS, off_newton

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from liggghts_driver.case import Case
    from liggghts_driver.studies.energy import Ran

    Array = NDArray[np.float64]

#: With a tenth of a contact as step the energy of an elastic contact is off by -1.8 to 1.5 % while
#: it lasts: the scheme conserves another one, nearby. It grows with the square of the step.
MOST_ENERGY = 0.05
#: Sums of as many terms as there are steps, each rounded to 1e-16.
MOST_MOMENTUM = 1e-9
#: Of the way that particles went: with a tenth of a contact as step a restitution is known to 3 %,
#: half of that error remains with half the step, and a second collision may double it.
MOST_CHANGE = 0.05
#: Of the way of a free piston, which the scheme makes longer by 1 / 40 at most.
MOST_OFF_NEWTON = 2.0 / FEWEST_STEPS
#: So many particles have a mean that is known better than the place of one of them.
_SEVERAL = 10


@dataclass(frozen=True)
class Invariant:
    """One thing that must hold.

    Attributes
    ----------
    worst, limit
        In one unit; the invariant holds up to the limit, and not where the worst is no number.
    why_not
        Why it says nothing of this scene; empty where it does.
    """

    name: str
    worst: float
    limit: float
    why_not: str = ""

    @property
    def applies(self) -> bool:
        """Whether it says anything of the scene."""
        return not self.why_not

    @property
    def share(self) -> float:
        """The worst value over the limit; infinite where nothing is allowed and something is."""
        if not self.applies:
            return 0.0
        if self.limit == 0.0 or not math.isfinite(self.worst):
            return 0.0 if self.worst == 0.0 else math.inf
        return self.worst / self.limit

    @property
    def broken(self) -> bool:
        """Whether it does not hold."""
        return self.share > 1.0

    @property
    def sentence(self) -> str:
        """Its worst value and its limit, in words."""
        return f"{self.name}: {self.worst:.3g}, at most {self.limit:.3g}"


def invariants_of(ran: Ran) -> list[Invariant]:
    """Everything that one run says by itself."""
    return [
        Invariant("numbers that are none", float(_not_finite(ran)), 0.0),
        Invariant("lost particles", float(_lost(ran)), 0.0),
        *_energy(ran),
        *_momentum(ran),
        Invariant(
            "overlap / radius",
            number_or_nan(ran.results["max_overlap_over_radius"]),
            ran.case.scene.contact.largest_overlap,
        ),
        *_piston(ran),
        *_reynolds(ran),
    ]


def hardest(invariants: Sequence[Invariant]) -> Invariant:
    """The one that is nearest to its limit, or furthest beyond."""
    return max(invariants, key=lambda each: each.share)


def changed_by(coarse: Ran, fine: Ran) -> Invariant:
    """Whether the particles go the same way with another step.

    Compared are places, their means over the second half of the run, as a share of the way that
    particles went. Where there are several particles it is their mean place, and twice the error of
    that mean is allowed beside, from the spread of the changes: in a bed one collision changes all
    that come after.
    """
    name = "change with half the step"
    ways = np.linalg.norm(fine.positions_m - fine.positions_m[0], axis=2).max(axis=0, initial=0.0)
    if not ways.any():
        return Invariant(name, 0.0, MOST_CHANGE, "no particle moves")
    count, scale = len(ways), float(np.sqrt((ways**2).mean()))
    # A run is whole steps: with another step it may end a little later.
    until_s = min(float(coarse.times_s[-1]), float(fine.times_s[-1]))
    change = _late(coarse, until_s) - _late(fine, until_s)
    if count < _SEVERAL:
        apart = float(np.sqrt((change**2).sum(axis=1).mean()))
        return Invariant(name, apart / scale, MOST_CHANGE)
    error = 2.0 * float(np.linalg.norm(change.std(axis=0, ddof=1))) / math.sqrt(count)
    apart = float(np.linalg.norm(change.mean(axis=0)))
    return Invariant(name, apart / scale, MOST_CHANGE + error / scale)


def _late(ran: Ran, until_s: float) -> Array:
    """Mean place of each particle over the second half of a time, ``(particles, 3)``."""
    places = ran.places_at(np.linspace(0.5, 1.0, 501) * until_s)
    return np.asarray(places.mean(axis=0))


def _not_finite(ran: Ran) -> int:
    # A flowing velocity is nan while nothing flows.
    series = ran.series.drop(columns=["flowing_velocity_m_s"], errors="ignore").to_numpy()
    arrays = (series, ran.positions_m, ran.velocities_m_s)
    return sum(int((~np.isfinite(array)).sum()) for array in arrays)


def _lost(ran: Ran) -> int:
    counts = ran.results["counts"]
    return int(abs(counts["asked"] - counts["at_end"]))


def _energy(ran: Ran) -> Iterator[Invariant]:
    name = "energy without work"
    contact = ran.case.scene.contact
    if contact.cohesion_energy_density > 0.0 or ran.case.scene.near_field is not None:
        yield Invariant(name, 0.0, MOST_ENERGY, "the energy of attraction is not counted")
        return
    energy, work = kinetic_j(ran) + elastic_j(ran), work_j(ran)
    free = energy - work + drag_taken_j(ran) - drag_given_j(ran)
    if Rotation().decide(ran.case.scene)[0]:
        grown = growth_from_start(free, energy, work, spin_j(ran.case))
    else:
        grown = growth_in_windows(free, energy, work)
    yield Invariant(name, grown, MOST_ENERGY)


def _momentum(ran: Ran) -> Iterator[Invariant]:
    name = "momentum"
    if (reason := _outside_force(ran.case)) is not None:
        yield Invariant(name, 0.0, MOST_MOMENTUM, reason)
        return
    each = ran.velocities_m_s * ran.masses_kg[None, :, None]
    total, scale = each.sum(axis=1), float(np.linalg.norm(each, axis=2).sum(axis=1).max())
    worst = float(np.linalg.norm(total - total[0], axis=1).max())
    yield Invariant(name, 0.0 if scale == 0.0 else worst / scale, MOST_MOMENTUM)


def _outside_force(case: Case) -> str | None:
    """What else than the particles themselves acts on them; None for nothing."""
    scene = case.scene
    forces = {
        "walls": bool(case.layout.walls),
        "fixed grains": case.population.grains > 0,
        "a piston": scene.piston is not None,
        "a fluid": scene.dragging_fluid is not None,
        "a pressure gradient": scene.pressure is not None,
        "gravity": scene.gravity is not None,
    }
    acting = [name for name, acts in forces.items() if acts]
    return f"{', '.join(acting)} act from outside" if acting else None


def _piston(ran: Ran) -> Iterator[Invariant]:
    if ran.case.scene.piston is None:
        return
    limit = SHARE_OF_LIMIT * speed_limit_m_s(ran.case)
    yield Invariant("piston's speed [m/s]", fastest_piston_m_s(ran.series), limit)
    off = off_newton(ran)
    why_not = "something may touch the piston from the start" if off is None else ""
    yield Invariant("free piston off a t²/2", off or 0.0, MOST_OFF_NEWTON, why_not)


def _reynolds(ran: Ran) -> Iterator[Invariant]:
    if "largest_reynolds" in ran.series:
        reached = float(ran.series["largest_reynolds"].max())
        yield Invariant("Reynolds number", reached, reynolds_bound(ran.case))
