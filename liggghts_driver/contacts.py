"""Who touches whom at an instant, how deep, and what energy the contacts hold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
from scipy.spatial import cKDTree

from liggghts_driver.physics.contact import effective_modulus_pa
from liggghts_driver.scene.elastic import fixed_body

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from liggghts_driver.population import Population
    from liggghts_driver.scene.elastic import Body as Kind
    from liggghts_driver.scene.layout import Layout
    from liggghts_driver.scene.model import Scene

    Floats = NDArray[np.float64]
    Rows = NDArray[np.int64]

#: In the place of a partner's row: a wall or the piston, which are planes.
PLANE = -1
_PARTNERS: dict[str, Kind] = {"particles": "particles", "grains": "grains"}


class Placed(Protocol):
    """A scene whose spheres are placed: a case, or what it is made of."""

    @property
    def scene(self) -> Scene:
        """The scene."""
        ...

    @property
    def layout(self) -> Layout:
        """Its geometry."""
        ...

    @property
    def population(self) -> Population:
        """Its spheres."""
        ...


@dataclass(frozen=True)
class Contacts:
    """Contacts of one kind: of particles with each other, with grains, or with one plane.

    Attributes
    ----------
    kind
        "particles", "grains" or the name of the plane: a face as "z+", or "piston".
    first, second
        Rows of the population, ``(n,)``; ``second`` is PLANE for a plane.
    overlaps_m, smaller_radii_m
        ``(n,)``; every overlap is above zero.
    """

    kind: str
    first: Rows
    second: Rows
    overlaps_m: Floats
    smaller_radii_m: Floats

    @property
    def over_radius(self) -> Floats:
        """Overlap over the radius of the smaller partner."""
        return self.overlaps_m / self.smaller_radii_m


def contacts_at(
    positions_m: Floats, case: Placed, rows: Rows | None = None, piston_x_m: float | None = None
) -> list[Contacts]:
    """Every contact of some particles.

    Parameters
    ----------
    positions_m
        ``(n, 3)``, finite.
    rows
        Whose positions these are, as rows of the population; by default those of all particles.
    piston_x_m
        Where the piston stands; its contacts are left out where that is not known.
    """
    whose = np.arange(len(positions_m)) if rows is None else rows
    found = [_pairs(positions_m, whose, case), _grains(positions_m, whose, case)]
    for name, gaps in _planes(positions_m, case, piston_x_m):
        radii = case.population.radii_m[whose]
        found.append(_touching(name, whose, np.full(len(whose), PLANE), radii - gaps, radii))
    return found


def largest_over_radius(contacts: list[Contacts]) -> float:
    """The largest overlap of any contact over the smaller radius; 0 where nothing touches."""
    return max((float(some.over_radius.max(initial=0.0)) for some in contacts), default=0.0)


def elastic_energy_j(contacts: list[Contacts], case: Placed) -> float:
    """Energy of the springs of all contacts: Hertz's, (8/15) E* sqrt(r*) overlap^(5/2) each."""
    touching = [some for some in contacts if len(some.overlaps_m)]
    return float(sum(energies_j(some, case).sum() for some in touching))


def energies_j(some: Contacts, case: Placed) -> Floats:
    """Energy of the spring of each contact, ``(n,)``."""
    radii = case.population.radii_m
    curvature = 1.0 / radii[some.first]
    if some.kind in ("particles", "grains"):
        curvature = curvature + 1.0 / radii[some.second]
    partner = _PARTNERS.get(some.kind, "walls")
    bodies = (fixed_body(case.scene, kind) for kind in ("particles", partner))
    modulus = effective_modulus_pa(*bodies)
    energies: Floats = 8.0 / 15.0 * modulus / np.sqrt(curvature) * some.overlaps_m**2.5
    return energies


def _touching(kind: str, first: Rows, second: Rows, overlaps: Floats, smaller: Floats) -> Contacts:
    touch = overlaps > 0.0
    return Contacts(kind, first[touch], second[touch], overlaps[touch], smaller[touch])


def _pairs(positions: Floats, whose: Rows, case: Placed) -> Contacts:
    radii = case.population.radii_m[whose]
    pairs = np.empty((0, 2), dtype=np.int64)
    if len(radii) > 1:
        pairs = cKDTree(positions).query_pairs(2.0 * float(radii.max()), output_type="ndarray")
    i, j = pairs[:, 0], pairs[:, 1]
    overlaps = radii[i] + radii[j] - np.linalg.norm(positions[i] - positions[j], axis=1)
    return _touching("particles", whose[i], whose[j], overlaps, np.minimum(radii[i], radii[j]))


def _grains(positions: Floats, whose: Rows, case: Placed) -> Contacts:
    population = case.population
    particle = grain = np.empty(0, dtype=np.int64)
    if population.grains and len(whose):
        centres = population.centres_m[population.particles :]
        reach = population.radii_m[population.particles :] + population.radii_m[whose].max()
        near = cKDTree(positions).query_ball_point(centres, reach)
        grain = population.particles + np.repeat(np.arange(len(near)), [len(n) for n in near])
        particle = np.concatenate([np.array(found, dtype=np.int64) for found in near])
    first = whose[particle]
    distances = np.linalg.norm(positions[particle] - population.centres_m[grain], axis=1)
    radii, sizes = population.radii_m[first], population.radii_m[grain]
    return _touching("grains", first, grain, radii + sizes - distances, np.minimum(radii, sizes))


def _planes(positions: Floats, case: Placed, piston_x_m: float | None) -> list[tuple[str, Floats]]:
    """Each plane, and how far the particles' centres are from it."""
    planes = []
    for face in case.layout.walls:
        axis = "xyz".index(face[0])
        low, high = case.layout.low[axis], case.layout.high[axis]
        along = positions[:, axis]
        planes.append((str(face), along - low if face[1] == "-" else high - along))
    if piston_x_m is not None:
        planes.append(("piston", positions[:, 0] - piston_x_m))
    return planes
