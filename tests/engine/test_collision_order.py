"""How the error of a collision falls with the step: the order of the scheme.

The scheme is velocity Verlet, which takes the damping force at a velocity half a step old: first
order as soon as there is damping. Without it the scheme is of second order and conserves its own
energy; all that is left of the error comes from the first and the last step of the contact, where
the force begins as overlap^(3/2), and such a corner costs step^(5/2).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from liggghts_driver.physics.contact import Body, elastic_duration_s
from liggghts_driver.studies.exact_contacts import Contact

from .encounters import DENSITY, FIRST_ORDER, PARTICLE_NU, RADIUS, SPEED, mass, material, sphere
from .hertz_reference import effective_modulus
from .support import order, stepping

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .support import Outcome, Simulator, Tables

pytestmark = pytest.mark.engine

FRACTIONS = np.array([1 / 40, 1 / 80, 1 / 160, 1 / 320])
PHASES = 48


def phases(restitution: float, fraction: float) -> Tables:
    """Equal pairs that touch at all phases of the step: a step is cut in 48."""
    body = Body(RADIUS, mass(RADIUS), 1e7, PARTICLE_NU)
    lasts = elastic_duration_s(body, body, 2.0 * SPEED)
    step = fraction * lasts
    gaps = (2.0 + (np.arange(PHASES) + 0.5) / PHASES) * 2.0 * SPEED * step
    lanes = 4.0 * RADIUS * np.arange(PHASES)
    spheres = []
    for gap, lane in zip(gaps, lanes, strict=True):
        for side in (-1.0, 1.0):
            place, velocity = [side * (RADIUS + gap / 2.0), lane, 0.0], np.array([-side, 0.0, 0.0])
            spheres.append(sphere(RADIUS, place, SPEED * velocity))
    steps = 10 * math.ceil((1.6 / fraction + 3.0) / 10.0)
    return {
        "particles": material(1e7, PARTICLE_NU) | {"density": DENSITY},
        "spheres": spheres,
        "contact": {"restitution": restitution},
        "box": {"low": [-0.01, -0.01, -0.01], "high": [0.01, float(lanes[-1]) + 0.01, 0.01]},
        **stepping(step, steps),
    }


def restitution_errors(outcomes: list[Outcome], restitution: float) -> NDArray[np.float64]:
    """``(steps, phases)``."""
    last = np.array([outcome.velocities_m_s[-1, :, 0] for outcome in outcomes])
    errors: NDArray[np.float64] = (last[:, 1::2] - last[:, ::2]) / (2.0 * SPEED) - restitution
    return errors


def test_damped_restitution_is_of_first_order(simulator: Simulator) -> None:
    restitutions = (0.1, 0.3, 0.5, 0.7)
    outcomes = simulator.run_all([phases(e, step) for e in restitutions for step in FRACTIONS])
    for number, restitution in enumerate(restitutions):
        mine = outcomes[number * len(FRACTIONS) : (number + 1) * len(FRACTIONS)]
        errors = restitution_errors(mine, restitution)
        # The mean over the phases; 0.1 is what the next term, step^(5/4), does to a fit over an
        # eightfold range.
        means = np.abs(errors.mean(axis=1))
        assert order(FRACTIONS, means)[0] == pytest.approx(1.0, abs=0.1), restitution
        assert np.abs(errors / FRACTIONS[:, None]).max() < FIRST_ORDER, restitution


def test_elastic_restitution_is_of_order_five_halves(simulator: Simulator) -> None:
    outcomes = simulator.run_all([phases(1.0, fraction) for fraction in FRACTIONS])
    errors = restitution_errors(outcomes, 1.0)
    rms = np.sqrt((errors**2).mean(axis=1))
    # 0.05: the finest error, 4e-7, still stands far above rounding.
    assert order(FRACTIONS, rms)[0] == pytest.approx(2.5, abs=0.05)
    assert np.abs(errors / FRACTIONS[:, None] ** 2.5).max() < 1.0


def test_overlap_in_time(simulator: Simulator) -> None:
    """The overlap through a damped collision, frame by frame."""
    tables = phases(0.3, 1 / 640)
    tables["spheres"] = tables["spheres"][:2]
    steps = 1200
    tables |= stepping(tables["time"]["step"], steps, frames=400)
    outcome = simulator.run(tables)
    x = outcome.positions_m[:, :, 0]
    contact = Contact(
        mass(RADIUS) / 2.0, RADIUS / 2.0, effective_modulus((1e7, 0.2), (1e7, 0.2)), 0.3
    )
    touch = (x[0, 1] - x[0, 0] - 2.0 * RADIUS) / (2.0 * SPEED)
    exact = contact.collide(2.0 * SPEED, outcome.times_s - touch).overlaps_m
    overlaps = np.maximum(2.0 * RADIUS - (x[:, 1] - x[:, 0]), 0.0)
    # First order: at most a step's way at the speed of approach.
    assert np.abs(overlaps - exact).max() < 2.0 * SPEED * outcome.case.time.step_s
    assert exact.max() > 100.0 * 2.0 * SPEED * outcome.case.time.step_s
