"""Scenes that have an exact answer are held to it: a lone sphere, a head-on collision."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from liggghts_driver.effects.contacts import restitution
from liggghts_driver.errors import ParseError
from liggghts_driver.physics.drag import free_flight_speed_m_s, pressure_force_n
from liggghts_driver.physics.spheres import sphere_volume_m3
from liggghts_driver.results.positions import iter_instants

if TYPE_CHECKING:
    from liggghts_driver.results.positions import Instant
    from liggghts_driver.run import FinishedRun
    from liggghts_driver.scene.model import Scene


def exact_checks(run: FinishedRun) -> list[dict[str, Any]]:
    """Every exact answer that the scene has, beside what the run gave.

    A list of ``name``, ``simulated``, ``exact`` and ``ratio``; empty for most scenes.

    Raises
    ------
    ParseError
        If the run has no frames any more.
    """
    scene = run.case.scene
    if scene.specimen is not None or scene.piston is not None or run.case.population.grains:
        return []
    if not (run.case.population.particles == 1 or _is_a_pair(run)):
        return []
    last = None
    for instant in iter_instants(run.directory):
        last = instant
    if last is None:
        raise ParseError(f"{run.directory.dumps}: there is no frame of the particles")
    return _collision(scene, last) if _is_a_pair(run) else _lone_sphere(scene, last)


def _is_a_pair(run: FinishedRun) -> bool:
    return run.case.population.particles == 2 and len(run.case.scene.spheres) == 2


def _check(name: str, simulated: float, exact: float) -> dict[str, Any]:
    ratio = simulated / exact if exact else None
    return {"name": name, "simulated": simulated, "exact": exact, "ratio": ratio}


def _lone_sphere(scene: Scene, last: Instant) -> list[dict[str, Any]]:
    """Free flight: the speed at which drag balances the pressure force (Eqs. 17-20)."""
    fluid, pressure = scene.dragging_fluid, scene.pressure
    still = fluid is not None and fluid.velocity_outside == "still" and scene.gravity is None
    if fluid is None or pressure is None or not still or len(scene.spheres) != 1:
        return []
    if pressure.period is not None:
        return []  # it never comes to a balance
    radius = scene.spheres[0].radius
    force = pressure_force_n(radius, pressure.gradient)
    exact = free_flight_speed_m_s(fluid.density, fluid.viscosity, radius, force)
    speed = float(last.velocities_m_s[0, 0])
    return [_check("free_flight_velocity_m_s", speed, math.copysign(exact, pressure.gradient))]


def _collision(scene: Scene, last: Instant) -> list[dict[str, Any]]:
    """Momentum and, for a head-on collision without a fluid or walls, restitution."""
    forces = (scene.fluid, scene.pressure, scene.gravity)
    walled = scene.box is not None and scene.box.walls
    if any(force is not None for force in forces) or walled:
        return []
    masses = np.array([sphere_volume_m3(sphere.radius) for sphere in scene.spheres])
    before = np.array([sphere.velocity for sphere in scene.spheres])
    after = last.velocities_m_s
    line = np.subtract(scene.spheres[1].position, scene.spheres[0].position)
    line /= np.linalg.norm(line)
    approach, parting = (before[0] - before[1]) @ line, (after[1] - after[0]) @ line
    scale = float((masses * np.linalg.norm(before, axis=1)).sum())
    drift = float(np.linalg.norm(masses @ (after - before)))
    checks = [_check("momentum_drift_over_scale", drift / scale if scale else 0.0, 0.0)]
    head_on = np.allclose(np.cross(before[0] - before[1], line), 0.0, atol=1e-9 * abs(approach))
    met = parting > 0 and approach > 0
    if head_on and met:
        checks.append(_check("restitution", float(parting / approach), restitution(scene)))
    return checks
