"""A case: what follows from its scene, spheres and steps."""

from __future__ import annotations

from dataclasses import replace

import pytest
from small_scenes import INFILTRATION, case_of


class TestSkin:
    """How far the neighbour lists reach goes with the way that bodies move in some steps."""

    @pytest.mark.parametrize(
        ("ways", "radii"),
        [(1e-6, 0.4), (0.3, 0.4), (0.7, 0.7), (1e3, 1.0)],
        ids=["short steps", "still short", "longer", "no further than this"],
    )
    def test_it_is_the_way_of_sixty_steps_within_bounds(self, ways: float, radii: float) -> None:
        case = case_of(INFILTRATION)
        radius = case.population.particle_radii_m.mean()
        step = ways * radius / (60 * case.speed_bound_m_s)
        made = replace(case, time=replace(case.time, step_s=step))
        assert made.skin_m == pytest.approx(radii * radius, rel=1e-12)
