"""The energy of a finished run: kinetic, elastic, and the work that was done on its bodies.

Energies come from the frames, which hold places and velocities of the same instant. The piston is
one of the bodies: what drives it is its own force M a, and what it does to the spheres stays inside
the sum. Nothing here is taken from the engine's own sums.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from itertools import repeat
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from liggghts_driver.contacts import contacts_at, elastic_energy_j
from liggghts_driver.effects.drag_law import inside_velocity_m_s
from liggghts_driver.physics.drag import drag_coefficient_n_s_m, pressure_force_n
from liggghts_driver.physics.oscillation import swing
from liggghts_driver.physics.spheres import INERTIA
from liggghts_driver.prepare import prepare
from liggghts_driver.results.positions import read_frames
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.speeds import fluid_acceleration_m_s2

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from liggghts_driver.case import Case
    from liggghts_driver.contacts import Contacts

    Array = NDArray[np.float64]


@dataclass(frozen=True)
class Ran:
    """A finished run, read once.

    Attributes
    ----------
    series
        Columns as ``series.csv`` has them.
    times_s
        ``(frames,)``, from the start on.
    positions_m, velocities_m_s
        ``(frames, particles, 3)``.
    results
        What ``results.json`` holds.
    """

    case: Case
    series: pd.DataFrame
    times_s: Array
    positions_m: Array
    velocities_m_s: Array
    results: dict[str, Any]

    @property
    def masses_kg(self) -> Array:
        """``(particles,)``."""
        density = self.case.scene.particles.density
        return np.asarray(density * self.case.population.particle_volumes_m3)

    def at_frames(self, column: Array) -> Array:
        """A column of the series at the instants of the frames."""
        return np.asarray(np.interp(self.times_s, self.series["time_s"].to_numpy(), column))

    @property
    def piston_x_m(self) -> Array:
        """Where the piston was in each frame, ``(frames,)``."""
        return self.at_frames(self.series["piston_x_m"].to_numpy())

    def contacts(self) -> Iterator[list[Contacts]]:
        """What touches in each frame; of places that are no numbers nothing is known."""
        piston = repeat(None) if self.case.scene.piston is None else self.piston_x_m.tolist()
        for places, stands in zip(self.positions_m, piston, strict=False):
            known = np.isfinite(places).all()
            yield contacts_at(places, self.case, piston_x_m=stands) if known else []

    def places_at(self, times_s: Array) -> Array:
        """Places of the particles between frames, ``(instants, particles, 3)``."""
        places = self.positions_m.reshape(len(self.times_s), -1).T
        found = [np.interp(times_s, self.times_s, place) for place in places]
        return np.array(found).T.reshape(len(times_s), -1, 3)


def read_ran(folder: Path) -> Ran:
    """Read what a finished and analysed run left in its directory."""
    run = RunDirectory(folder)
    case = prepare(run.read_scene())
    case = replace(case, time=replace(case.time, **run.read_state()["time"]))
    frames = read_frames(run)
    return Ran(
        case=case,
        series=pd.read_csv(run.series),
        times_s=np.asarray(frames.steps * case.time.step_s, dtype=float),
        positions_m=frames.positions_m,
        velocities_m_s=frames.velocities_m_s,
        results=json.loads(run.results.read_text(encoding="utf-8")),
    )


def kinetic_j(ran: Ran) -> Array:
    """Of the particles' flight and of the piston, ``(frames,)``; spin is not in the frames."""
    squares = (ran.velocities_m_s**2).sum(axis=2)
    found = 0.5 * (squares * ran.masses_kg).sum(axis=1)
    if ran.case.scene.piston is not None:
        speed = ran.at_frames(piston_velocity_m_s(ran.series))
        found = found + 0.5 * ran.case.piston_mass_kg * speed**2
    return np.asarray(found)


def piston_velocity_m_s(series: pd.DataFrame) -> Array:
    """Of each row, from the places before and after it; at rest in the first."""
    time, place = series["time_s"].to_numpy(), series["piston_x_m"].to_numpy()
    velocity = np.asarray(np.gradient(place, time))
    velocity[0] = 0.0
    return velocity


def spin_j(case: Case) -> float:
    """Energy of the spins at the start, which may become flight."""
    radii, spins = case.population.particle_radii_m, case.population.spins_rad_s
    squares = (spins[: case.population.particles] ** 2).sum(axis=1)
    masses = case.scene.particles.density * case.population.particle_volumes_m3
    return float((0.5 * INERTIA * masses * radii**2 * squares).sum())


def elastic_j(ran: Ran) -> Array:
    """Hertz's (8/15) E* sqrt(r*) overlap^(5/2) of every contact, ``(frames,)``.

    Springs along the surface are left out: energy in them is missing, never too much.
    """
    return np.array([elastic_energy_j(contacts, ran.case) for contacts in ran.contacts()])


def work_j(ran: Ran) -> Array:
    """Work done by pressure, weight and the piston's own force since the start, ``(frames,)``."""
    scene, found = ran.case.scene, _pressure_work_j(ran)
    if scene.gravity is not None:
        heights = (ran.positions_m - ran.positions_m[0]) @ np.array(scene.gravity.acceleration)
        found += (1.0 - scene.buoyed_share) * (heights * ran.masses_kg).sum(axis=1)
    if scene.piston is not None:
        place = ran.series["piston_x_m"].to_numpy()
        force = ran.case.piston_mass_kg * scene.piston.acceleration
        found += force * ran.at_frames(place - place[0])
    return found


def _pressure_work_j(ran: Ran) -> Array:
    """The force of Eq. 20 over the way, inside the specimen or in the box.

    From one frame to the next a gradient cos(w t) counts as at the middle of the two: an error of
    second order in the time T between frames, up to (w T)^2 / 8 of the work in between where
    velocities change as slowly as the gradient.
    """
    scene, pressure = ran.case.scene, ran.case.scene.pressure
    if pressure is None:
        return np.zeros(len(ran.times_s))
    x = ran.positions_m[:, :, 0]
    inside = np.maximum(x, 0.0) if scene.specimen is not None else x
    forces = pressure_force_n(1.0, pressure.gradient) * ran.case.population.particle_radii_m**3
    middles = (ran.times_s[1:] + ran.times_s[:-1]) / 2.0
    each = (np.diff(inside, axis=0) * forces).sum(axis=1) * swing(middles, pressure.period)
    return np.append(0.0, np.cumsum(each))


def drag_taken_j(ran: Ran) -> Array:
    """The least that a fluid at rest has taken by each frame, ``(frames,)``.

    No branch of Eq. 18 is below Stokes' law, so K v^2 is at least 6 pi mu r v^2. Between two frames
    the slower of both speeds counts: a particle may have stopped right after the first.
    """
    fluid = ran.case.scene.dragging_fluid
    if fluid is None or fluid_moves(ran.case):
        return np.zeros(len(ran.times_s))
    stokes = 6.0 * math.pi * fluid.viscosity * ran.case.population.particle_radii_m
    squares = (ran.velocities_m_s**2).sum(axis=2)
    slower = np.minimum(squares[1:], squares[:-1])
    each = (slower * stokes).sum(axis=1) * np.diff(ran.times_s)
    return np.append(0.0, np.cumsum(each))


def drag_given_j(ran: Ran) -> Array:
    """The most that a moving fluid can have given by each frame, ``(frames,)``.

    In a fluid of velocity u the power -K (v - u) v is positive only for v between 0 and u, where
    the slip is below |u|: it is at most K(|u|) u^2 / 4, since v (u - v) is.
    """
    fluid = ran.case.scene.dragging_fluid
    if fluid is None or not fluid_moves(ran.case):
        return np.zeros(len(ran.times_s))
    time, speed = ran.series["time_s"].to_numpy(), _fluid_speeds_m_s(ran)
    radii = ran.case.population.particle_radii_m
    drag = drag_coefficient_n_s_m(fluid.density, fluid.viscosity, radii[None, :], speed[:, None])
    power = drag.sum(axis=1) * speed**2 / 4.0
    larger = np.maximum(power[1:], power[:-1])
    return ran.at_frames(np.append(0.0, np.cumsum(larger * np.diff(time))))


def fluid_moves(case: Case) -> bool:
    """Whether the fluid moves anywhere."""
    fluid = case.scene.dragging_fluid
    if fluid is None:
        return False
    return fluid.velocity_outside != "still" or inside_velocity_m_s(case) != 0.0


def _fluid_speeds_m_s(ran: Ran) -> Array:
    """The larger of the fluid's speeds inside and outside, in each row of the series."""
    scene, time = ran.case.scene, ran.series["time_s"].to_numpy()
    fluid = scene.dragging_fluid
    assert fluid is not None
    outside = np.zeros(len(time))
    if fluid.velocity_outside == "piston":
        outside = piston_velocity_m_s(ran.series)
    elif fluid.velocity_outside == "constant":
        outside = np.full(len(time), fluid.velocity)
    elif fluid.velocity_outside == "accelerating":
        outside = fluid_acceleration_m_s2(scene) * time
    return np.maximum(np.abs(outside), abs(inside_velocity_m_s(ran.case)))
