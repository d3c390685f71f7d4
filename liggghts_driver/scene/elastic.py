"""How stiff the bodies of a scene are in its contacts."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

from liggghts_driver.physics import contact
from liggghts_driver.physics.spheres import sphere_volume_m3

if TYPE_CHECKING:
    from liggghts_driver.scene.model import Scene

Body = Literal["particles", "grains", "walls"]


def bodies_of(scene: Scene) -> tuple[Body, ...]:
    """The kinds of bodies of which a scene says how stiff they are."""
    return ("particles", "walls", "grains") if scene.grains else ("particles", "walls")


def elastic(scene: Scene, body: Body) -> tuple[float, float]:
    """Young's modulus [Pa], softened as the scene says, and Poisson's ratio of a kind of body.

    Walls and piston are as the particles where the scene does not say otherwise.
    """
    particles = scene.particles
    table = {"particles": particles, "grains": scene.grains, "walls": scene.walls}[body]
    assert table is not None
    modulus = table.youngs_modulus or particles.youngs_modulus
    ratio = particles.poissons_ratio if table.poissons_ratio is None else table.poissons_ratio
    return scene.contact.stiffness_scale * modulus, ratio


def particle_body(scene: Scene, radius_m: float) -> contact.Body:
    """A particle of some radius as a partner of contacts."""
    mass = scene.particles.density * sphere_volume_m3(radius_m)
    return contact.Body(radius_m, mass, *elastic(scene, "particles"))


def fixed_body(scene: Scene, body: Body, radius_m: float = math.inf) -> contact.Body:
    """What does not move as a partner: a grain of some radius, or without one a plane."""
    return contact.Body(radius_m, math.inf, *elastic(scene, body))
