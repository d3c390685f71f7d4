"""A case: a scene with everything that follows from it before the engine is asked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from liggghts_driver.bounds import LONGEST_SKIN, mean_radius_m
from liggghts_driver.loads import piston_mass_kg
from liggghts_driver.population import Population, populate
from liggghts_driver.scene.layout import Layout, layout
from liggghts_driver.speeds import speed_bound_m_s
from liggghts_driver.timestep import TimePlan, plan_time

if TYPE_CHECKING:
    from collections.abc import Callable

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


#: Steps in which the fastest bodies come nearer by the skin, within bounds [mean particle radii].
_STEPS_OF_A_LIST = 60
_SHORTEST_SKIN = 0.4


@dataclass(frozen=True)
class Case:
    """A scene, its geometry, its spheres and its steps.

    ``speed_bound_m_s`` is the speed for which the contact bound on the step was computed.
    ``screened`` names the effects that were left out as too weak, and ``asked`` is then the scene
    with them, which is what the run is known by. ``checkpoint`` is None for a run from the start.
    ``edit`` changes the deck's text behind the back of all that was checked; None but in studies of
    what is then caught.
    """

    scene: Scene
    layout: Layout
    population: Population
    time: TimePlan
    speed_bound_m_s: float
    screened: tuple[str, ...] = ()
    asked: Scene | None = None
    checkpoint: Checkpoint | None = None
    edit: Callable[[str], str] | None = None

    @property
    def identity(self) -> Scene:
        """The scene that was asked for."""
        return self.asked or self.scene

    @property
    def materials(self) -> tuple[Body, ...]:
        """The kinds of bodies that exist, in the order of the engine's atom types.

        The engine wants an atom of its first type: without particles that is a grain.
        """
        present: dict[Body, bool] = {
            "particles": self.population.particles > 0,
            "grains": self.population.grains > 0,
            "walls": bool(self.layout.walls) or self.scene.piston is not None,
        }
        here = [name for name, is_here in present.items() if is_here]
        return tuple(dict.fromkeys([*here, "particles"]))

    def type_of(self, material: Body) -> int:
        """The engine's number of a material."""
        return self.materials.index(material) + 1

    @property
    def skin_m(self) -> float:
        """How far beyond contact the neighbour lists reach.

        A longer reach has more pairs looked at in each step, a shorter one has the lists built
        more often, which costs as much as tens of steps. Where steps are long it pays to reach
        further: as far as two bodies can come nearer in some steps.
        """
        radius = mean_radius_m(self.population)
        way = _STEPS_OF_A_LIST * self.time.step_s * self.speed_bound_m_s
        return min(max(way, _SHORTEST_SKIN * radius), LONGEST_SKIN * radius)

    @property
    def piston_mass_kg(self) -> float:
        """Mass of the piston: as given, or that of the suspension before it."""
        return piston_mass_kg(self.scene, self.layout, self.population.particle_volume_m3)


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
    speed = speed_bound_m_s(scene, place, population)
    return Case(scene, place, population, plan_time(scene, place, population, speed), speed)
