"""A case: a scene with everything that follows from it before the engine is asked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from liggghts_driver.population import Population, populate
from liggghts_driver.scene.layout import Layout, layout, particle_fraction
from liggghts_driver.timestep import TimePlan, plan_time, speed_bound_m_s

if TYPE_CHECKING:
    from liggghts_driver.scene.elastic import Body
    from liggghts_driver.scene.model import Scene


@dataclass(frozen=True)
class Checkpoint:
    """Where an interrupted run goes on: its first, second ... checkpoint.

    ``restart`` is the engine's restart file, as seen from the run directory.
    """

    number: int
    step: int
    restart: str
    piston_velocity_m_s: float


@dataclass(frozen=True)
class Case:
    """A scene, its geometry, its spheres and its steps.

    ``speed_bound_m_s`` is the speed for which the contact bound on the step was computed.
    ``screened`` names the effects that were left out as too weak, and ``asked`` is then the scene
    with them, which is what the run is known by. ``checkpoint`` is None for a run from the start.
    """

    scene: Scene
    layout: Layout
    population: Population
    time: TimePlan
    speed_bound_m_s: float
    screened: tuple[str, ...] = ()
    asked: Scene | None = None
    checkpoint: Checkpoint | None = None

    @property
    def identity(self) -> Scene:
        """The scene that was asked for."""
        return self.asked or self.scene

    @property
    def materials(self) -> tuple[Body, ...]:
        """The kinds of bodies that exist, in the order of the engine's atom types."""
        present: dict[Body, bool] = {
            "particles": True,
            "grains": self.population.grains > 0,
            "walls": bool(self.layout.walls) or self.scene.piston is not None,
        }
        return tuple(name for name, here in present.items() if here)

    def type_of(self, material: Body) -> int:
        """The engine's number of a material."""
        return self.materials.index(material) + 1

    @property
    def skin_m(self) -> float:
        """How far beyond contact the neighbour lists reach: 0.4 of the mean particle radius."""
        radii = self.population.particle_radii_m
        return 0.4 * float(radii.mean() if len(radii) else self.population.radii_m.mean())

    @property
    def piston_mass_kg(self) -> float:
        """Mass of the piston: as given, or that of the suspension before it."""
        piston = self.scene.piston
        assert piston is not None
        if piston.mass is not None:
            return piston.mass
        particles = self.population.particle_volume_m3 * self.scene.particles.density
        if self.scene.fluid is None:
            return particles
        fraction = particle_fraction(self.scene, self.layout)
        volume = self.population.particle_volume_m3 / fraction
        return particles + self.scene.fluid.density * volume * (1.0 - fraction)


def make_case(scene: Scene) -> Case:
    """Place the spheres and choose the step of a checked scene.

    Raises
    ------
    PackingError
        If the spheres cannot be placed.
    SceneError
        If the step asked for is above a bound.
    """
    place = layout(scene)
    population = populate(scene, place)
    time = plan_time(scene, place, population)
    return Case(scene, place, population, time, speed_bound_m_s(scene, place, population))
