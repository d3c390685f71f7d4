"""Contacts softened by a factor last longer by its power -0.4, and are otherwise Hertz's."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from small_scenes import COLLISION, case_of, changed

from .support import stepping

if TYPE_CHECKING:
    from .support import Simulator

pytestmark = pytest.mark.engine

SCALES = (1.0, 1e-1, 1e-2, 1e-3)
SPEED = 0.01


def test_the_step_grows_as_the_contact_does() -> None:
    steps = [case_of(COLLISION, {"contact.stiffness_scale": s}).time.bound_s for s in SCALES]
    exponents = np.diff(np.log(steps)) / np.diff(np.log(SCALES))
    # Exact: Hertz's contact time goes with the modulus to the power -2/5.
    assert exponents == pytest.approx(-0.4, abs=1e-12)


def test_softer_contacts_on_the_engine(simulator: Simulator) -> None:
    """Duration and depth of a collision, and the same restitution, in steps of equal shares."""
    overlaps, speeds = [], []
    for scale in SCALES:
        tables = changed(COLLISION, {"contact.stiffness_scale": scale})
        # So many steps for each contact, and enough of them to part again.
        contact_s = case_of(tables).time.bound_s / 0.1
        gap_s = 2e-4 / SPEED
        duration_s = gap_s + 2.0 * contact_s
        outcome = simulator.run(tables | stepping(duration_s / 4000, 4000, 4000 // 10))
        distance = np.linalg.norm(outcome.positions_m[:, 0] - outcome.positions_m[:, 1], axis=1)
        overlaps.append(0.003 - distance.min())
        relative = outcome.velocities_m_s[:, 1, 0] - outcome.velocities_m_s[:, 0, 0]
        speeds.append(relative[-1] / SPEED)
    # The depth goes with the same power as the duration; frames miss the deepest instant by up to
    # half an interval, (pi / 2 * 10 / 600)^2 / 2 = 3e-4 of the depth for the longest intervals.
    powers = np.diff(np.log(overlaps)) / np.diff(np.log(SCALES))
    assert powers == pytest.approx(-0.4, abs=2e-3)
    # Tsuji's damping makes the restitution one number for every stiffness: e of xi_n = 0.1.
    beta = 0.1 * math.sqrt(6.0 / 5.0)
    exact = math.exp(-math.pi * beta / math.sqrt(1.0 - beta**2))
    assert np.array(speeds) == pytest.approx(
        exact, rel=3e-3
    )  # 0.31 of a step over a contact's duration
