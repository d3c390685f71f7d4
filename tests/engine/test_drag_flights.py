"""Spheres launched into fluids that stand, flow and accelerate: the drag is a vector."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from .falls import EQ_18, Fall
from .support import order, stepping

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .support import Outcome, Simulator, Tables

pytestmark = pytest.mark.engine

SPHERE = Fall(radius=1e-3, density=2500.0, fluid_density=1000.0, viscosity=1e-3, force=0.0)
#: A third of the Stokes relaxation time: about m / K at the Reynolds numbers met here, 20 to 50.
RELAXATION = SPHERE.mass / (6.0 * math.pi * SPHERE.viscosity * SPHERE.radius) / 3.0
FRAMES = 20


class Flight(NamedTuple):
    """How the sphere starts [m/s], and the fluid: at a speed and an acceleration along x."""

    launch: tuple[float, float, float]
    fluid: Tables
    speed: float = 0.0
    acceleration: float = 0.0


FLIGHTS = {
    "oblique": Flight((0.01, -0.02, 0.015), {"velocity_outside": "still"}),
    "flow": Flight((0.0, 0.0, 0.01), {"velocity_outside": "constant", "velocity": 0.02}, 0.02),
    "counterflow": Flight(
        (0.01, 0.01, 0.0), {"velocity_outside": "constant", "velocity": -0.02}, -0.02
    ),
    "accelerating": Flight(
        (0.0, 0.0, 0.0),
        {"velocity_outside": "accelerating", "acceleration": 0.1},
        acceleration=0.1,
    ),
    "accelerating backwards": Flight(
        (0.0, 0.0, 0.0),
        {"velocity_outside": "accelerating", "acceleration": -0.1},
        acceleration=-0.1,
    ),
}


def scene(flight: Flight, step_s: float, every: int, drag: Tables) -> Tables:
    """One and a half relaxations."""
    steps = FRAMES * every * math.ceil(1.5 * RELAXATION / (FRAMES * every * step_s))
    return {
        "particles": {"density": SPHERE.density, "youngs_modulus": 1e6, "poissons_ratio": 0.25},
        "spheres": [
            {"radius": SPHERE.radius, "position": [0.0, 0.0, 0.0], "velocity": list(flight.launch)}
        ],
        "fluid": {
            "density": SPHERE.fluid_density,
            "viscosity": SPHERE.viscosity,
            **flight.fluid,
        },
        "drag": drag,
        "contact": {"restitution": 0.5},
        "box": {"low": [-0.05, -0.05, -0.05], "high": [0.05, 0.05, 0.05]},
        **stepping(step_s, steps, FRAMES),
    }


def exact(flight: Flight, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Velocities ``(times, 3)`` from Eqs. 17-19."""

    def motion(time: float, velocity: NDArray[np.float64]) -> NDArray[np.float64]:
        slip = np.array([flight.speed + flight.acceleration * time, 0.0, 0.0]) - velocity
        speed = float(np.linalg.norm(slip))
        if speed == 0.0:
            return np.zeros(3)
        reynolds = SPHERE.reynolds(speed)
        branch = next(n for n, (up_to, _, _) in enumerate(EQ_18) if reynolds <= up_to)
        return SPHERE.drag(speed, branch) / SPHERE.mass * slip / speed

    solution = solve_ivp(
        motion,
        (0.0, float(times[-1])),
        flight.launch,
        method="DOP853",
        rtol=1e-10,
        atol=1e-14,
        t_eval=times,
    )
    velocities: NDArray[np.float64] = solution.y.T
    return velocities


def error(outcome: Outcome, flight: Flight) -> float:
    """Largest error of a velocity, over the largest velocity."""
    reference = exact(flight, outcome.times_s)
    wrong = np.abs(outcome.velocities_m_s[:, 0] - reference).max()
    return float(wrong / np.abs(reference).max())


def test_exact(simulator: Simulator) -> None:
    steps = RELAXATION / np.array([40, 80, 160])
    flown = [(flight, step) for flight in FLIGHTS.values() for step in steps]
    outcomes = simulator.run_all([scene(f, step, 1, {"scheme": "exact"}) for f, step in flown])
    pairs = zip(outcomes, flown, strict=True)
    errors = np.reshape([error(o, flight) for o, (flight, _) in pairs], (len(FLIGHTS), len(steps)))
    # First order: half a step late. 0.03: the next term, 1 % of the first at the longest step.
    assert order(steps, errors.T) == pytest.approx(1.0, abs=0.03)
    # Half a step late costs at most half a step's share of the fastest relaxation, which is less
    # than twice as fast as RELAXATION.
    assert np.all(errors < steps / RELAXATION)


@pytest.mark.parametrize("scheme", ["held", "implicit"])
def test_kept_coefficients(simulator: Simulator, scheme: str) -> None:
    """Held for a tenth of a relaxation, in a step a 64th of that."""
    interval, every = RELAXATION / 10, 64
    drag = {"scheme": scheme, "refresh": interval}
    scenes = [scene(flight, interval / every, every, drag) for flight in FLIGHTS.values()]
    for flight, outcome in zip(FLIGHTS.values(), simulator.run_all(scenes), strict=True):
        assert outcome.case.time.refresh_every == every
        # The first interval is one step of Euler's: half of (interval x rate)^2 of the slip, with
        # the rate K (1 + p) / m at which a slip relaxes when K goes with |slip|^p, p = 0.354.
        reference = exact(flight, outcome.times_s)
        fluid = np.outer(flight.speed + flight.acceleration * outcome.times_s, [1.0, 0.0, 0.0])
        slip = float(np.linalg.norm(fluid - reference, axis=1).max())
        rate = 1.354 * SPHERE.reynolds(slip) ** 0.354 / (3.0 * RELAXATION)
        largest = 0.5 * (interval * rate) ** 2 * slip / np.abs(reference).max()
        assert error(outcome, flight) < largest
