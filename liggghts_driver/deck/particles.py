"""The engine's data file: the box, and every sphere."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from liggghts_driver.case import Case


def simulation_box(case: Case) -> list[tuple[float, float]]:
    """Bounds of the engine's box [m] per axis: the domain, with room for what sticks out.

    An open face of a box scene stays where the scene puts it: a particle that leaves is lost,
    and the run says so.
    """
    population, layout = case.population, case.layout
    radii, centres = population.radii_m[:, None], population.centres_m
    low = np.minimum(np.array(layout.low), (centres - radii).min(axis=0, initial=0.0))
    high = np.maximum(np.array(layout.high), (centres + radii).max(axis=0, initial=0.0))
    # The piston's surface reaches a little beyond the walls.
    overhang = 0.1 * max(np.subtract(layout.high, layout.low)[1:])
    room = float(population.radii_m.max(initial=0.0)) + case.skin_m + overhang
    bounds = []
    for number, axis in enumerate("xyz"):
        first, last = layout.low[number], layout.high[number]
        if _enclosed(case, axis, "-"):
            first = float(low[number] - room)
        if _enclosed(case, axis, "+"):
            last = float(high[number] + room)
        bounds.append((first, last))
    return bounds


def _enclosed(case: Case, axis: str, side: str) -> bool:
    """Whether something at that face needs room: a wall, the piston, or grains that stick out."""
    beside_piston = case.scene.piston is not None and f"{axis}{side}" != "x+"
    wall = f"{axis}{side}" in case.layout.walls
    return wall or beside_piston or case.scene.specimen is not None


def particle_data(case: Case) -> str:
    """Text of the data file, numbers to full precision."""
    population = case.population
    out = io.StringIO()
    out.write(f"LIGGGHTS data: {population.particles} particles, {population.grains} grains\n\n")
    out.write(f"{len(population.radii_m)} atoms\n{len(case.materials)} atom types\n")
    for axis, (low, high) in zip("xyz", simulation_box(case), strict=True):
        out.write(f"{low!r} {high!r} {axis}lo {axis}hi\n")
    if len(population.radii_m):
        out.write("\nAtoms\n\n")
        out.writelines(_atoms(case))
    if population.velocities_m_s.any() or population.spins_rad_s.any():
        out.write("\nVelocities\n\n")
        out.writelines(_velocities(case))
    return out.getvalue()


def _atoms(case: Case) -> list[str]:
    population, scene = case.population, case.scene
    grain_density = (scene.grains.density if scene.grains else None) or scene.particles.density
    lines = []
    rows = zip(population.centres_m.tolist(), population.radii_m.tolist(), strict=True)
    for row, (centre, radius) in enumerate(rows):
        particle = row < population.particles
        kind = case.type_of("particles" if particle else "grains")
        density = scene.particles.density if particle else grain_density
        x, y, z = centre
        lines.append(f"{row + 1} {kind} {2 * radius!r} {density!r} {x!r} {y!r} {z!r}\n")
    return lines


def _velocities(case: Case) -> list[str]:
    motions = np.hstack([case.population.velocities_m_s, case.population.spins_rad_s]).tolist()
    return [f"{row} {' '.join(map(repr, m))}\n" for row, m in enumerate(motions, start=1)]
