"""Attraction across a gap: its law, its end, and that the contacts are what they were."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from .support import stepping

if TYPE_CHECKING:
    from .support import Simulator, Tables

pytestmark = pytest.mark.engine

RADIUS, DENSITY, FORCE, REACH = 1e-3, 2500.0, 1e-6, 5e-4
MASS = DENSITY * 4.0 / 3.0 * math.pi * RADIUS**3
END = 2.0 * RADIUS + REACH


def pair(gap: float, kind: str = "particle") -> Tables:
    """Two spheres at rest with a gap between them, for so short a time that it stays."""
    grain = {"grains": {"youngs_modulus": 1e7, "poissons_ratio": 0.25}} if kind == "grain" else {}
    return {
        "particles": {"density": DENSITY, "youngs_modulus": 1e7, "poissons_ratio": 0.25},
        "spheres": [
            {"radius": RADIUS, "position": [0.0, 0.0, 0.0]},
            {"radius": RADIUS, "position": [2.0 * RADIUS + gap, 0.0, 0.0], "kind": kind},
        ],
        "near_field": {"force": FORCE, "reach": REACH},
        "contact": {"restitution": 0.5},
        "box": {"low": [-0.005, -0.005, -0.005], "high": [0.01, 0.005, 0.005]},
        **grain,
        **stepping(1e-6, 1000),
    }


def attraction(gap: float) -> float:
    """The law as the documentation has it."""
    if gap >= REACH:
        return 0.0
    angle = math.pi / END
    return FORCE * math.sin(angle * (2.0 * RADIUS + gap)) / math.sin(angle * 2.0 * RADIUS)


def test_the_law_over_its_range(simulator: Simulator) -> None:
    gaps = np.array([0.02, 0.2, 0.5, 0.8, 0.98, 1.02, 2.0]) * REACH
    for gap, outcome in zip(gaps, simulator.run_all([pair(g) for g in gaps]), strict=True):
        time = outcome.times_s[-1]
        moved = 0.5 * attraction(gap) / MASS * time**2
        pushes = outcome.velocities_m_s[-1, :, 0] * MASS / time
        # Both come nearer by `moved`, on which the force changes by at most its steepest slope.
        slope = FORCE * math.pi / END / math.sin(math.pi * 2.0 * RADIUS / END)
        allowed = 2.0 * moved * slope + 1e-12 * FORCE
        assert pushes == pytest.approx([attraction(gap), -attraction(gap)], abs=allowed)


def test_grains_do_not_attract(simulator: Simulator) -> None:
    outcome = simulator.run(pair(0.2 * REACH, "grain"))
    assert np.all(outcome.velocities_m_s == 0.0)


def test_a_collision_beside_a_vanishing_field_is_the_collision(simulator: Simulator) -> None:
    """The least field that a scene may have moves nobody: the contacts are those without."""
    tables = pair(0.2 * REACH)
    tables["spheres"][0]["velocity"] = [0.1, 0.0, 0.0]
    tables |= stepping(1e-6, 10000)
    faint = {**tables, "near_field": {"force": 1e-30, "reach": REACH}}
    none = {name: table for name, table in tables.items() if name != "near_field"}
    one, other = simulator.run_all([faint, none])
    assert np.array_equal(one.velocities_m_s, other.velocities_m_s)
    assert one.velocities_m_s[-1, 1, 0] > 0.05  # they met
