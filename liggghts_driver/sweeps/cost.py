"""What runs will cost, without placing their spheres: steps, engine time and disk.

The time step hangs on the smallest and the largest radius, and on the number of particles. Both
follow from the distribution well enough: with its expected extremes in the place of all spheres,
steps come out within a few percent of those of the run.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import ndtr, ndtri

from liggghts_driver.case import Case
from liggghts_driver.effects import active_effects
from liggghts_driver.errors import SceneError
from liggghts_driver.explain import core_times_s, disk_bytes
from liggghts_driver.population import Population
from liggghts_driver.prepare import weak_effects, without
from liggghts_driver.scene.layout import (
    layout,
    mean_particle_volume_m3,
    moving_count,
    particle_count,
)
from liggghts_driver.speeds import speed_bound_m_s
from liggghts_driver.timestep import plan_time

if TYPE_CHECKING:
    from collections.abc import Container

    from liggghts_driver.scene.layout import Layout
    from liggghts_driver.scene.model import Radii, Scene, Specimen
    from liggghts_driver.sweeps.plan import Plan
    from liggghts_driver.timestep import TimePlan

#: A step above its bound by less may still be within the bound of the spheres as they will be.
_DOUBT = 0.05


@dataclass(frozen=True)
class Cost:
    """What a run is expected to cost.

    Attributes
    ----------
    steps, particles
        Their numbers.
    core_s_dilute, core_s_packed
        Engine time on one core, if the suspension stays dilute, and as a packed bed.
    disk_bytes
        Size of frames, snapshots and logs.
    """

    steps: int
    particles: int
    core_s_dilute: float
    core_s_packed: float
    disk_bytes: int

    @property
    def particle_steps(self) -> int:
        """What the engine's time is proportional to; a run without particles counts as of one."""
        return max(1, self.particles) * self.steps


@dataclass(frozen=True)
class PlanCost:
    """What a sweep is expected to cost: sums over its runs, each counted once."""

    runs: int
    particle_steps: int
    core_s_dilute: float
    core_s_packed: float
    disk_bytes: int


def predict_cost(scene: Scene) -> Cost:
    """Predict what a run of a scene will cost; takes well under a millisecond.

    Raises
    ------
    SceneError
        If the step asked for is surely above a bound, or no step can be found.
    """
    case = _stand_in(scene)
    weak = weak_effects(case)
    if weak:
        case = _stand_in(without(scene, weak))
    particles = moving_count(case.scene, case.layout)
    cost = sum(effect.cost(case) for effect in active_effects(case.scene))
    times = core_times_s(particles, case.time.steps, cost)
    return Cost(
        steps=case.time.steps,
        particles=particles,
        core_s_dilute=times["dilute"],
        core_s_packed=times["packed"],
        disk_bytes=disk_bytes(case, particles),
    )


def plan_cost(plan: Plan, runs: Container[str] | None = None) -> PlanCost:
    """What the runs of a plan cost together, or some of them, as predicted when it was made."""
    costs = [cost for run, cost in plan.costs.items() if runs is None or run in runs]
    return PlanCost(
        runs=len(costs),
        particle_steps=sum(cost.particle_steps for cost in costs),
        core_s_dilute=sum(cost.core_s_dilute for cost in costs),
        core_s_packed=sum(cost.core_s_packed for cost in costs),
        disk_bytes=sum(cost.disk_bytes for cost in costs),
    )


def _stand_in(scene: Scene) -> Case:
    """The case of a scene with a few typical spheres in the place of all."""
    place = layout(scene)
    population = _typical(scene, place)
    speed = speed_bound_m_s(scene, place, population)
    return Case(scene, place, population, _time(scene, place, population, speed), speed)


def _time(scene: Scene, place: Layout, population: Population, speed_m_s: float) -> TimePlan:
    """The steps; a step of the user's that may be within its bounds is taken to be."""
    try:
        return plan_time(scene, place, population, speed_m_s)
    except SceneError as error:
        refused = error
    if scene.time.step is None:
        raise refused
    fraction = scene.time.step_fraction * (1.0 + _DOUBT)
    time = scene.time.model_copy(update={"step_fraction": fraction})
    try:
        relaxed = scene.model_copy(update={"time": time})
        return plan_time(relaxed, place, population, speed_m_s)
    except SceneError:
        raise refused from None


def _typical(scene: Scene, place: Layout) -> Population:
    """Single spheres as they are; of each distribution its smallest, mean and largest radius."""
    movers = [sphere for sphere in scene.spheres if sphere.kind == "particle"]
    fixed = [sphere.radius for sphere in scene.spheres if sphere.kind == "grain"]
    drawn = expected_radii_m(scene.particles, particle_count(scene, place))
    grains = _grain_radii_m(scene)
    radii = np.array([*drawn, *(sphere.radius for sphere in movers), *grains, *fixed])
    vectors = np.zeros((len(radii), 3))
    velocities = vectors.copy()
    for row, sphere in enumerate(movers, start=len(drawn)):
        velocities[row] = sphere.velocity
    particles = len(drawn) + len(movers)
    return Population(vectors, radii, velocities, vectors, particles, particles, math.nan)


def _grain_radii_m(scene: Scene) -> list[float]:
    if scene.specimen is None or scene.grains is None:
        return []
    return expected_radii_m(scene.grains, _grain_count(scene.specimen, scene.grains))


def _grain_count(specimen: Specimen, grains: Radii) -> int:
    """Expected number of grains: their fraction of the volume in which their centres lie.

    A cut from the bulk keeps each grain that meets the cuboid, whose centre may be a radius
    outside: V + S r + pi r^2 (a + b + c) + 4/3 pi r^3 for edges a, b, c.
    """
    edges = (specimen.length, specimen.width, specimen.height or specimen.width)
    volume = math.prod(edges)
    if specimen.cut == "bulk":
        a, b, c = edges
        r = grains.radius_mean or 0.0
        volume += 2.0 * (a * b + b * c + c * a) * r
        volume += math.pi * r**2 * (a + b + c) + 4.0 / 3.0 * math.pi * r**3
    return max(1, round(specimen.solid_fraction * volume / mean_particle_volume_m3(grains)))


def expected_radii_m(radii: Radii, count: int) -> list[float]:
    """Smallest, mean and largest of ``count`` radii of a distribution, as expected [m].

    The extremes are quantiles of the truncated Gaussian at (n - 3/8) / (n + 1/4) (Blom 1958),
    which is within a few hundredths of a deviation. Of fewer than three spheres as many radii.
    """
    mean = radii.radius_mean
    if mean is None or count == 0:
        return []
    below = float(ndtr(-radii.radius_truncation))
    rank = (count - 0.375) / (count + 0.25)
    score = float(ndtri(below + (1.0 - 2.0 * below) * rank))
    # A truncation far out takes nothing away, and leaves no last quantile in double precision.
    reach = radii.radius_deviation * min(score, radii.radius_truncation)
    if count == 1:
        return [mean]
    return [mean - reach, mean + reach] if count == 2 else [mean - reach, mean, mean + reach]
