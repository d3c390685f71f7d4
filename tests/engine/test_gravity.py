"""Weight and buoyancy: free fall, and settling or rising through a fluid."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from .falls import Fall
from .support import stepping

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .support import Simulator, Tables

pytestmark = pytest.mark.engine

GRAVITY = np.array([2.0, -3.0, -9.0])
FLUID_DENSITY, RADIUS = 1000.0, 1e-3


def lone_sphere(density: float, way: NDArray[np.float64]) -> Tables:
    """A sphere at rest at the origin, in a box that holds its way."""
    return {
        "particles": {"density": density, "youngs_modulus": 1e6, "poissons_ratio": 0.25},
        "spheres": [{"radius": RADIUS, "position": [0.0, 0.0, 0.0]}],
        "gravity": {"acceleration": GRAVITY.tolist()},
        "contact": {"restitution": 0.5},
        "box": {
            "low": (np.minimum(way, 0.0) - 0.01).tolist(),
            "high": (np.maximum(way, 0.0) + 0.01).tolist(),
        },
    }


def test_free_fall(simulator: Simulator) -> None:
    """Velocity Verlet follows a parabola exactly."""
    step, steps = 1e-4, 1000
    way = GRAVITY * (step * steps) ** 2 / 2.0
    outcome = simulator.run({**lone_sphere(2500.0, way), **stepping(step, steps)})
    times = outcome.times_s[:, None]
    # Rounding: one unit in the last place for each step and sum.
    rounding = steps * np.finfo(float).eps
    assert outcome.velocities_m_s[:, 0] == pytest.approx(GRAVITY * times, abs=9.0 * 0.1 * rounding)
    ways = GRAVITY * times**2 / 2.0
    assert outcome.positions_m[:, 0] == pytest.approx(ways, abs=9.0 * 0.005 * rounding)


def immersed(density: float, viscosity: float) -> Fall:
    """Weight less buoyancy, as the force on a sphere."""
    net = abs(density - FLUID_DENSITY) * 4.0 / 3.0 * math.pi * RADIUS**3
    force = net * float(np.linalg.norm(GRAVITY))
    return Fall(RADIUS, density, FLUID_DENSITY, viscosity, force)


def velocity(fall: Fall) -> NDArray[np.float64]:
    """Final velocity: down for what is heavier than the fluid, up for what is lighter."""
    down = GRAVITY / np.linalg.norm(GRAVITY)
    return math.copysign(fall.final_speed, fall.density - FLUID_DENSITY) * down


def settling(fall: Fall, scheme: str) -> Tables:
    """Twelve relaxation times, which leave exp(-12), 6e-6, of the start."""
    step, steps = fall.relaxation / 40, 480
    return {
        **lone_sphere(fall.density, step * steps * velocity(fall)),
        **stepping(step, steps),
        "fluid": {"density": FLUID_DENSITY, "viscosity": fall.viscosity},
        "drag": {"scheme": scheme},
    }


@pytest.mark.parametrize("scheme", ["exact", "held", "implicit"])
def test_settling_and_rising(simulator: Simulator, scheme: str) -> None:
    """The speed at which drag carries the weight less buoyancy."""
    falls = [immersed(density, 1e-2) for density in (7000.0, 1200.0, 800.0, 20.0)]
    outcomes = simulator.run_all([settling(fall, scheme) for fall in falls])
    for fall, outcome in zip(falls, outcomes, strict=True):
        final = outcome.velocities_m_s[-1, 0]
        assert final == pytest.approx(velocity(fall), rel=2e-5), fall.density


def test_a_bubble_rises_beyond_the_second_branch(simulator: Simulator) -> None:
    """At Re = 480: the deck must hold the branch of Eq. 18 from Re = 400 on.

    A bubble's own weight says nothing of its speed, which buoyancy alone sets.
    """
    bubble = immersed(20.0, 1e-3)
    assert bubble.final_reynolds > 450.0
    final = simulator.run(settling(bubble, "implicit")).velocities_m_s[-1, 0]
    assert final == pytest.approx(velocity(bubble), rel=2e-5)


def test_as_heavy_as_the_fluid(simulator: Simulator) -> None:
    """Weight and buoyancy are equal and opposite: only their rounding is left."""
    tables = {
        **lone_sphere(FLUID_DENSITY, np.zeros(3)),
        **stepping(1e-3, 1000),
        "fluid": {"density": FLUID_DENSITY, "viscosity": 1e-3},
    }
    assert np.abs(simulator.run(tables).velocities_m_s).max() < 1e-15
