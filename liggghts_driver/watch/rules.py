"""The rules of the watch: each fires only where the verdict after the run can only be "invalid".

not a number
    A number of the series, a place or a velocity is not finite.
speed
    A particle is faster than ``SPEED_MARGIN`` times the speed for which the step was chosen, and
    the step does not resolve a contact at that speed. The verdict asks the same without the margin.
energy
    The particles, or particles and contacts together, hold more than the scene's energy budget
    with its margin (``results/energy.py``). The verdict asks the same of the particles.
reynolds
    A particle is beyond the branches of the drag law that are in the deck. So does the verdict.
overlap
    A contact in a frame, or in a row that of the piston with a fixed grain, is deeper than ten
    times ``contact.largest_overlap`` or than half a radius, whichever is less, and deeper than
    ``contact.largest_overlap``, which is where the verdict draws the line: Hertz's law means
    nothing there.
lost
    A particle is not in a frame. (In between the engine counts by itself, and ends.)
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from liggghts_driver.contacts import elastic_energy_j, largest_over_radius
from liggghts_driver.effects.drag_law import reynolds_bound
from liggghts_driver.results.collisions import hertz_limit
from liggghts_driver.results.energy import Budget, energy_budget
from liggghts_driver.results.verdict import (
    STEP_TOLERANCE,
    contact_step_limit_s,
    piston_in_grains,
)

if TYPE_CHECKING:
    from liggghts_driver.case import Case
    from liggghts_driver.contacts import Contacts
    from liggghts_driver.watch.finding import Rule
    from liggghts_driver.watch.tail import Row, Snapshot

#: A particle may be this many times faster than was expected before a run is stopped for it. The
#: duration of a contact goes with the speed to the power -1/5: less is a matter of accuracy.
SPEED_MARGIN = 5.0
_OVERLAP_MARGIN = 10.0
#: So many ids of lost particles are named.
NAMED = 5


@dataclass(frozen=True)
class Breach:
    """A rule that was broken, in words and in numbers."""

    rule: Rule
    seen: str
    value: float
    limit: float


@dataclass(frozen=True)
class Limits:
    """What a case must not pass; computed once for a run."""

    speed_m_s: float
    energy: Budget | None
    overlap_over_radius: float
    reynolds: float

    @classmethod
    def of(cls, case: Case) -> Limits:
        """Limits of a case."""
        allowed = case.scene.contact.largest_overlap
        return cls(
            speed_m_s=SPEED_MARGIN * case.speed_bound_m_s,
            energy=energy_budget(case),
            overlap_over_radius=min(_OVERLAP_MARGIN * allowed, hertz_limit(case)),
            reynolds=reynolds_bound(case) if case.scene.dragging_fluid else math.inf,
        )


def breach_of_row(row: Row, case: Case, limits: Limits) -> Breach | None:
    """The first rule that a row of the series breaks."""
    # In this order: the rules after the first compare numbers.
    return (
        _numbers(row)
        or _speed(row, case, limits)
        or _energy(row, limits)
        or _re(row, limits)
        or _piston(row, case, limits)
    )


def _numbers(row: Row) -> Breach | None:
    broken = [name for name, value in row.items() if not math.isfinite(value)]
    if not broken:
        return None
    return Breach("not a number", f"not a number in {', '.join(broken)}", math.nan, math.inf)


def _speed(row: Row, case: Case, limits: Limits) -> Breach | None:
    fastest = row["largest_speed_m_s"]
    if fastest <= limits.speed_m_s:
        return None
    longest = contact_step_limit_s(case, fastest)
    if case.time.step_s <= STEP_TOLERANCE * longest:
        return None
    seen = (
        f"a particle has {fastest:.3g} m/s, {case.speed_bound_m_s:.3g} were expected: contacts "
        f"then need a step of at most {longest:.3g} s, it is {case.time.step_s:.3g} s"
    )
    return Breach("speed", seen, fastest, limits.speed_m_s)


def _energy(row: Row, limits: Limits) -> Breach | None:
    return _over_budget("kinetic energy", row["kinetic_energy_j"], limits)


def _over_budget(what: str, energy_j: float, limits: Limits) -> Breach | None:
    if limits.energy is None or energy_j <= limits.energy.limit_j:
        return None
    seen = (
        f"the particles have {energy_j:.3g} J of {what}; the limit is "
        f"{limits.energy.limit_j:.3g} J, {limits.energy}"
    )
    return Breach("energy", seen, energy_j, limits.energy.limit_j)


def _re(row: Row, limits: Limits) -> Breach | None:
    found = math.sqrt(row.get("largest_reynolds_squared", 0.0))
    if found <= limits.reynolds:
        return None
    seen = f"a particle has Re = {found:.4g}; the deck's drag law ends at {limits.reynolds:g}"
    return Breach("reynolds", seen, found, limits.reynolds)


def _piston(row: Row, case: Case, limits: Limits) -> Breach | None:
    depth, grain = piston_in_grains(case, row["piston_x_m"]) if "piston_x_m" in row else (0.0, 0)
    if depth <= limits.overlap_over_radius:
        return None
    seen = (
        f"the piston overlaps grain {grain} by {depth:.3g} of its radius; a run is stopped at "
        f"{limits.overlap_over_radius:g}, and contact.largest_overlap is "
        f"{case.scene.contact.largest_overlap:g}"
    )
    return Breach("overlap", seen, depth, limits.overlap_over_radius)


def breach_of_places(snapshot: Snapshot, case: Case) -> Breach | None:
    """The rules of a frame that come before any geometry: all there, and all numbers."""
    missing = missing_ids(snapshot, case)
    if missing:
        seen = f"{len(missing)} of {case.population.particles} particles are lost: {named(missing)}"
        return Breach("lost", seen, float(len(missing)), 0.0)
    broken = broken_ids(snapshot)
    if broken:
        seen = f"place or velocity is not a number for particles {named(broken)}"
        return Breach("not a number", seen, math.nan, math.inf)
    return None


def breach_of_contacts(
    snapshot: Snapshot, contacts: list[Contacts], case: Case, limits: Limits
) -> Breach | None:
    """The rules of a frame about what touches: how deep, and how much energy there is."""
    deepest = largest_over_radius(contacts)
    if deepest > limits.overlap_over_radius:
        seen = (
            f"a contact overlaps by {deepest:.3g} of the smaller radius; a run is stopped at "
            f"{limits.overlap_over_radius:g}, and contact.largest_overlap is "
            f"{case.scene.contact.largest_overlap:g}"
        )
        return Breach("overlap", seen, deepest, limits.overlap_over_radius)
    masses = case.scene.particles.density * case.population.particle_volumes_m3
    kinetic = float(masses @ snapshot.speeds_m_s**2) / 2.0
    held = kinetic + elastic_energy_j(contacts, case)
    return _over_budget("kinetic and elastic energy", held, limits)


def missing_ids(snapshot: Snapshot, case: Case) -> list[int]:
    """Ids of particles that are not in a frame."""
    return sorted({*range(1, case.population.particles + 1)} - set((snapshot.rows + 1).tolist()))


def broken_ids(snapshot: Snapshot) -> list[int]:
    """Ids of particles whose place or velocity is not a number."""
    ids: list[int] = (snapshot.rows[~snapshot.finite] + 1).tolist()
    return ids


def named(ids: list[int]) -> str:
    """The first few ids, and how many there are besides."""
    more = f" and {len(ids) - NAMED} more" if len(ids) > NAMED else ""
    return ", ".join(map(str, ids[:NAMED])) + more
