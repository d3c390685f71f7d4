"""Friction: a sphere that slides on a plane ends up rolling."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from liggghts_driver.physics.contact import Body, elastic_duration_s

from .hertz_reference import effective_modulus
from .support import order, stepping

if TYPE_CHECKING:
    from .support import Simulator, Tables

pytestmark = pytest.mark.engine

RADIUS, DENSITY, MODULUS, NU = 1.5e-3, 2500.0, 1e7, 0.25
MASS = DENSITY * 4.0 / 3.0 * math.pi * RADIUS**3
GRAVITY, SPEED = 9.81, 0.1
#: Overlap at which the plane carries the weight.
OVERLAP = (
    MASS
    * GRAVITY
    / (4.0 / 3.0 * effective_modulus((MODULUS, NU), (MODULUS, NU)) * math.sqrt(RADIUS))
) ** (2.0 / 3.0)
FRAMES = 100
FRACTIONS = np.array([1 / 20, 1 / 40, 1 / 80])


def sliding(friction: float, fraction: float, **sphere: list[float]) -> Tables:
    """A sphere that lies on the plane z = 0, sent along it, for three times the sliding.

    Friction stops the sliding after 2/7 v / (mu g). The step is a fraction of an impact's duration.
    """
    ball, plane = Body(RADIUS, MASS, MODULUS, NU), Body(math.inf, math.inf, MODULUS, NU)
    step = fraction * elastic_duration_s(ball, plane, SPEED)
    steps = FRAMES * math.ceil(6.0 / 7.0 * SPEED / (friction * GRAVITY) / step / FRAMES)
    place = {"radius": RADIUS, "position": [0.0, 0.0, RADIUS - OVERLAP]}
    return {
        "particles": {"density": DENSITY, "youngs_modulus": MODULUS, "poissons_ratio": NU},
        "spheres": [place | (sphere or {"velocity": [SPEED, 0.0, 0.0]})],
        "gravity": {"acceleration": [0.0, 0.0, -GRAVITY]},
        "contact": {"restitution": 0.5, "friction": friction},
        "box": {"low": [-0.02, -0.02, 0.0], "high": [0.03, 0.02, 0.01], "walls": ["z-"]},
        **stepping(step, steps, FRAMES),
    }


def test_sliding_becomes_rolling(simulator: Simulator) -> None:
    """It ends at 5/7 of its speed, whatever the friction.

    The force acts where the contact is: half an overlap above the sphere's lowest point, at the
    lever c = r - overlap / 2. Angular momentum then gives v / (1 + 2/5 (r / c)^2).
    """
    outcomes = simulator.run_all([sliding(friction, 1 / 80) for friction in (0.1, 0.3, 0.5)])
    lever = RADIUS - OVERLAP / 2.0
    rolling = SPEED / (1.0 + 0.4 * (RADIUS / lever) ** 2)
    for outcome in outcomes:
        final = outcome.velocities_m_s[-1, 0, 0]
        # 1e-5: the last of the tangential spring's oscillation.
        assert final == pytest.approx(rolling, rel=1e-5)
        # The textbook's sphere is rigid: 5/7 is right to the overlap over the radius.
        assert final == pytest.approx(5.0 / 7.0 * SPEED, rel=OVERLAP / RADIUS)
        assert outcome.velocities_m_s[:, 0, 1:] == pytest.approx(0.0, abs=1e-12)


def test_a_spinning_sphere_gains_speed(simulator: Simulator) -> None:
    """Set down at rest but spinning, it ends at 2/7 of the speed of its surface."""
    spin = SPEED / RADIUS
    outcome = simulator.run(sliding(0.3, 1 / 80, velocity=[0.0, 0.0, 0.0], spin=[0.0, spin, 0.0]))
    # As above: a rigid sphere, to the overlap over the radius.
    final = outcome.velocities_m_s[-1, 0, 0]
    assert final == pytest.approx(2.0 / 7.0 * SPEED, rel=2.0 * OVERLAP / RADIUS)


def test_sliding_is_slowed_by_friction(simulator: Simulator) -> None:
    """While it slides, it loses mu g per second.

    In a contact's first step the engine's tangential damping acts without Coulomb's limit, for
    its spring is still empty: an impulse of first order in the step.
    """
    friction = 0.1
    outcomes = simulator.run_all([sliding(friction, fraction) for fraction in FRACTIONS])
    lost = []
    for outcome in outcomes:
        times, speeds = outcome.times_s, outcome.velocities_m_s[:, 0, 0]
        slides = (times > 0) & (times < 0.8 * 2.0 / 7.0 * SPEED / (friction * GRAVITY))
        rates = np.diff(speeds[slides]) / np.diff(times[slides])
        # 1e-9: rounding of differences of a thousandth of the speed.
        assert rates == pytest.approx(-friction * GRAVITY, rel=1e-9)
        lost.append(SPEED - friction * GRAVITY * times[slides][-1] - speeds[slides][-1])
    # 0.05: the impulse acts over one step to a part in a thousand.
    assert order(FRACTIONS, lost)[0] == pytest.approx(1.0, abs=0.05)


def test_without_friction_nothing_rolls(simulator: Simulator) -> None:
    tables = sliding(0.1, 1 / 20)
    tables["contact"]["friction"] = 0.0
    outcome = simulator.run(tables)
    assert np.all(outcome.velocities_m_s[:, 0, 0] == SPEED)
