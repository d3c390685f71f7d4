"""How stiff the bodies of a scene are in its contacts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

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
