"""How deep collisions can have been that no frame shows.

A collision lasts some ten steps, and between two frames there are hundreds: what the frames show is
the deepest contact of those few instants. The energy of a collision bounds what was in between.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.physics.contact import largest_overlap_m
from liggghts_driver.results.series import fastest_piston_m_s
from liggghts_driver.scene.elastic import fixed_body, particle_body

if TYPE_CHECKING:
    from collections.abc import Iterator

    import pandas as pd

    from liggghts_driver.case import Case
    from liggghts_driver.physics.contact import Body

#: So many radii stand for all: the overlap over the smaller radius changes by 4 % at most between
#: equal spheres and the ratio at which it is largest.
_RADII = 9
_DEEPEST = 0.5


def collision_overlap_over_radius(case: Case, speed_m_s: float, piston_m_s: float = 0.0) -> float:
    """Overlap, over the smaller radius, that no collision of two bodies exceeds.

    Hertz without damping, m* v^2 / 2 = (8/15) E* sqrt(r*) overlap^(5/2): head-on for two particles,
    each with the largest speed; with that speed on fixed grains, on walls and on the piston.

    Parameters
    ----------
    case
        Its bodies. nan where they attract each other, 0 where nothing can collide.
    speed_m_s, piston_m_s
        The largest speed of a particle, and of the piston.
    """
    contact = case.scene.contact
    if contact.cohesion_energy_density or case.scene.near_field is not None:
        return math.nan
    return max(_overlaps(case, speed_m_s, piston_m_s), default=0.0)


def _overlaps(case: Case, speed: float, piston: float) -> Iterator[float]:
    population = case.population
    if not population.particles:
        return
    radii = population.particle_radii_m
    several = np.linspace(radii.min(), radii.max(), _RADII).tolist()
    particles = [particle_body(case.scene, radius) for radius in several]
    if population.particles > 1:
        # The smallest has partners of every ratio of radii that there is.
        yield from (_over_radius(particles[0], other, 2.0 * speed) for other in particles)
    if population.grains:
        smallest = float(population.radii_m[population.particles :].min())
        grain = fixed_body(case.scene, "grains", smallest)
        yield from (_over_radius(particle, grain, speed) for particle in particles)
    if case.layout.walls or case.scene.piston is not None:
        yield _over_radius(particles[0], fixed_body(case.scene, "walls"), speed + piston)


def _over_radius(a: Body, b: Body, speed_m_s: float) -> float:
    return largest_overlap_m(a, b, speed_m_s) / min(a.radius_m, b.radius_m)


def hertz_limit(case: Case) -> float:
    """The overlap over the smaller radius at which Hertz's law means nothing any more."""
    return max(case.scene.contact.largest_overlap, _DEEPEST)


def unseen_collisions(case: Case, series: pd.DataFrame, seen_over_radius: float) -> str | None:
    """A sentence where collisions can have been deeper than allowed, and no frame shows any.

    No reason against an answer: what is that fast need not have met anybody.
    """
    fastest = float(series["largest_speed_m_s"].max())
    deepest = collision_overlap_over_radius(case, fastest, fastest_piston_m_s(series))
    allowed = case.scene.contact.largest_overlap
    if not seen_over_radius <= allowed < deepest:
        return None
    through = ": contacts as soft as that hold nothing apart" * (deepest > hertz_limit(case))
    return (
        f"the frames show overlaps of up to {seen_over_radius:.2g} of the smaller radius, but not "
        f"the instants between; a collision at the largest speed, {fastest:.3g} m/s, overlaps by "
        f"up to {deepest:.2g}{through}"
    )
