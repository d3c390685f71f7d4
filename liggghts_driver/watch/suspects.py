"""Who it was: the particles and contacts of a frame that a diagnosis points at, in words."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.contacts import PLANE, Contacts, contacts_at
from liggghts_driver.deck.particles import simulation_box
from liggghts_driver.effects.drag_law import inside_velocity_m_s
from liggghts_driver.watch.rules import NAMED, broken_ids, missing_ids, named

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from liggghts_driver.case import Case
    from liggghts_driver.watch.finding import Rule
    from liggghts_driver.watch.tail import Snapshot

#: A sphere that is its diameter deep in a plane has gone through.
_THROUGH = 2.0


def suspects(
    rule: Rule, snapshot: Snapshot | None, case: Case, piston_x_m: float | None
) -> tuple[str, ...]:
    """Whom to look at, in the frame at hand: the fastest, the deepest contact, the missing."""
    if snapshot is None:
        return ("the run ended before its first frame was whole",)
    frame = f"in the frame of step {snapshot.step} ({snapshot.step * case.time.step_s:.4g} s)"
    missing, broken = missing_ids(snapshot, case), broken_ids(snapshot)
    found = [f"{frame}: missing: {named(missing)}"] if missing else []
    found += [f"{frame}: not a number: {named(broken)}"] if broken else []
    if snapshot.finite.any():
        contacts = whole_contacts(snapshot, case, piston_x_m)
        fastest, deepest = _fastest(rule, snapshot, case), _deepest(contacts, snapshot)
        words = [deepest, fastest] if rule == "overlap" else [fastest, deepest]
        found += [f"{frame}: {text}" for text in words]
        if rule == "lost":
            found += [f"{frame}: {_leaving(snapshot, case)}"]
    return tuple(found)


def last_seen(ids: list[int], snapshot: Snapshot, case: Case) -> tuple[str, ...]:
    """Where the first of some particles were in an earlier frame."""
    frame = f"in the frame before, of step {snapshot.step}"
    rows = [row for row in np.array(ids[:NAMED]) - 1 if row in snapshot.rows]
    found = [int(np.flatnonzero(snapshot.rows == row)[0]) for row in rows]
    return tuple(f"{frame}: {_particle(snapshot, index, case)}" for index in found)


def whole_contacts(snapshot: Snapshot, case: Case, piston_x_m: float | None) -> list[Contacts]:
    """Contacts of the particles whose places are numbers."""
    whole = snapshot.finite
    return contacts_at(snapshot.positions_m[whole], case, snapshot.rows[whole], piston_x_m)


def _fastest(rule: Rule, snapshot: Snapshot, case: Case) -> str:
    """The fastest particle, or the one with the largest Re."""
    speeds = snapshot.speeds_m_s
    if rule == "reynolds":
        slip = snapshot.velocities_m_s - _fluid_velocities_m_s(snapshot, case)
        speeds = np.linalg.norm(slip, axis=1) * case.population.radii_m[snapshot.rows]
        return f"largest Re: {_particle(snapshot, int(np.nanargmax(speeds)), case)}"
    return f"fastest: {_particle(snapshot, int(np.nanargmax(speeds)), case)}"


def _fluid_velocities_m_s(snapshot: Snapshot, case: Case) -> NDArray[np.float64]:
    """The fluid's velocity at each particle, where it is constant; at rest elsewhere."""
    fluid = case.scene.fluid
    velocities = np.zeros_like(snapshot.velocities_m_s)
    if fluid is not None and fluid.velocity_outside == "constant":
        velocities[:, 0] = fluid.velocity
    if case.scene.specimen is not None:
        velocities[snapshot.positions_m[:, 0] >= 0.0, 0] = inside_velocity_m_s(case)
    return velocities


def _particle(snapshot: Snapshot, index: int, case: Case) -> str:
    row = int(snapshot.rows[index])
    return (
        f"particle {row + 1} at {_vector(snapshot.positions_m[index])} m, radius "
        f"{case.population.radii_m[row]:.4g} m, velocity "
        f"{_vector(snapshot.velocities_m_s[index])} m/s"
    )


def _vector(values: NDArray[np.float64]) -> str:
    return f"({', '.join(f'{value:.4g}' for value in values)})"


def _deepest(contacts: list[Contacts], snapshot: Snapshot) -> str:
    """The deepest contact over the smaller radius: who, how deep, where."""
    touching = [some for some in contacts if len(some.overlaps_m)]
    if not touching:
        return "nothing touches"
    some = max(touching, key=lambda found: float(found.over_radius.max()))
    index = int(some.over_radius.argmax())
    first, second = int(some.first[index]), int(some.second[index])
    place = snapshot.positions_m[int(np.flatnonzero(snapshot.rows == first)[0])]
    gone = second == PLANE and some.over_radius[index] > _THROUGH
    return (
        f"deepest contact: particle {first + 1} and {_partner(some.kind, second)}"
        f"{', which it has gone through' if gone else ''}, overlap "
        f"{some.overlaps_m[index]:.3g} m, {some.over_radius[index]:.3g} of the smaller radius "
        f"({some.smaller_radii_m[index]:.4g} m), particle {first + 1} at {_vector(place)} m"
    )


def _partner(kind: str, row: int) -> str:
    if row != PLANE:
        return f"{'particle' if kind == 'particles' else 'grain'} {row + 1}"
    return "the piston" if kind == "piston" else f"the wall {kind}"


def _leaving(snapshot: Snapshot, case: Case) -> str:
    """The particle that is the next to leave the engine's box, and by which face."""
    times = []
    for number, (low, high) in enumerate(simulation_box(case)):
        at, velocity = snapshot.positions_m[:, number], snapshot.velocities_m_s[:, number]
        way = np.where(velocity > 0.0, high - at, at - low)
        with np.errstate(divide="ignore", invalid="ignore"):
            times.append(np.where(velocity == 0.0, math.inf, way / np.abs(velocity)))
    table = np.where(np.isfinite(times), times, math.inf)
    axis, index = divmod(int(table.argmin()), table.shape[1])
    if not math.isfinite(table[axis, index]):
        return "nothing was on its way out"
    side = "+" if snapshot.velocities_m_s[index, axis] > 0.0 else "-"
    face = f"{'xyz'[axis]}{side}"
    wall = "a wall" if face in case.layout.walls else "open"
    return (
        f"next to leave: {_particle(snapshot, index, case)}, by {face} ({wall}) within "
        f"{table[axis, index]:.3g} s if nothing stops it"
    )
