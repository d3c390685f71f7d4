"""All spheres of a scene: the right ones, in the right rows, apart, and the same every time."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial import cKDTree
from small_scenes import COLLISION, GONE, GRAIN, INFILTRATION, MATERIAL, case_of, scene_of

from liggghts_driver.errors import PackingError
from liggghts_driver.population import populate
from liggghts_driver.scene.layout import layout

GRAINS = {"youngs_modulus": 1.0e6, "poissons_ratio": 0.25}
MIXED = {
    "particles": {**MATERIAL, "radius_mean": 0.0008, "radius_deviation": 0.0001, "count": 30},
    "grains": GRAINS,
    "spheres": [GRAIN, {**COLLISION["spheres"][0], "spin": [1.0, 2.0, 3.0]}],
}


@pytest.fixture(autouse=True)
def no_cache(tmp_path, monkeypatch):
    """Every packing is computed here, in a folder of its own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


def people(tables, changes=None):
    scene = scene_of(tables, changes)
    return populate(scene, layout(scene))


def test_the_same_scene_gives_the_same_bytes(tmp_path, monkeypatch):
    first = people(INFILTRATION)
    cached = people(INFILTRATION)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "other"))
    again = people(INFILTRATION)
    for other in (cached, again):
        assert other.centres_m.tobytes() == first.centres_m.tobytes()
        assert other.radii_m.tobytes() == first.radii_m.tobytes()
        assert other.solid_fraction == first.solid_fraction


def test_another_seed_gives_another_population():
    one, two = people(INFILTRATION), people(INFILTRATION, {"seed": 2})
    assert not np.array_equal(one.centres_m[: one.particles], two.centres_m[: two.particles])
    assert not np.array_equal(one.radii_m[one.particles :], two.radii_m[two.particles :])


def test_more_particles_leave_the_specimen_as_it_is():
    one, two = people(INFILTRATION), people(INFILTRATION, {"particles.count": 50})
    assert np.array_equal(one.centres_m[one.particles :], two.centres_m[two.particles :])


def test_counts():
    population = people(INFILTRATION)
    assert population.particles == population.asked == 40
    assert population.grains == len(population.radii_m) - 40 > 0
    assert len(population.particle_radii_m) == 40
    volume = 4 / 3 * math.pi * (population.radii_m[:40] ** 3).sum()
    assert population.particle_volume_m3 == pytest.approx(volume, rel=1e-12)
    assert not population.velocities_m_s.any()
    assert not population.spins_rad_s.any()


def test_particles_fill_the_reservoir_and_touch_nobody():
    scene = scene_of(INFILTRATION)
    place = layout(scene)
    population = populate(scene, place)
    centres, radii = population.centres_m[:40], population.particle_radii_m
    assert (centres >= np.array(place.fill_low) + radii[:, None]).all()
    assert (centres <= np.array(place.fill_high) - radii[:, None]).all()
    assert radii.min() >= 0.0015 - 3 * 0.0001
    assert radii.max() <= 0.0015 + 3 * 0.0001
    largest = population.radii_m.max() + radii.max()
    everyone = cKDTree(population.centres_m)
    for row, (centre, radius) in enumerate(zip(centres, radii, strict=True)):
        others = [i for i in everyone.query_ball_point(centre, largest) if i != row]
        distance = np.linalg.norm(population.centres_m[others] - centre, axis=1)
        # Rounding of coordinates of a few centimetres.
        assert (distance > population.radii_m[others] + radius - 1e-15).all()


def test_single_spheres_keep_their_rows_motions_and_kinds():
    population = people(COLLISION, MIXED)
    assert population.particles == population.asked == 31
    assert population.grains == 1
    # The suspension, then the single particles, then the grains.
    assert population.centres_m[30].tolist() == [-0.0016, 0.0, 0.0]
    assert population.radii_m[30:].tolist() == [0.0015, 0.002]
    assert population.velocities_m_s[30].tolist() == [0.005, 0.0, 0.0]
    assert population.spins_rad_s[30].tolist() == [1.0, 2.0, 3.0]
    assert not np.delete(population.velocities_m_s, 30, axis=0).any()
    assert population.centres_m[31].tolist() == [0.01, 0.0, 0.0]
    assert math.isnan(population.solid_fraction)


def test_the_suspension_keeps_away_from_single_spheres():
    population = people(COLLISION, MIXED)
    for single in (30, 31):
        distance = np.linalg.norm(population.centres_m[:30] - population.centres_m[single], axis=1)
        assert (distance > population.radii_m[:30] + population.radii_m[single] - 1e-15).all()


def test_grains_fill_the_specimen_as_measured():
    """The measured solid fraction against counting points of a lattice that lie inside grains."""
    population = people(INFILTRATION)
    axis = (np.arange(80) + 0.5) / 80 * 0.02
    x, y, z = np.meshgrid(axis, axis - 0.01, axis - 0.01, indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    inside = np.zeros(len(points), dtype=bool)
    for centre, radius in zip(population.centres_m[40:], population.radii_m[40:], strict=True):
        inside |= np.linalg.norm(points - centre, axis=1) < radius
    # A lattice of 80^3 points errs by less than a part in 10^3 for spheres of 16 lattice lengths.
    assert population.solid_fraction == pytest.approx(inside.mean(), abs=2e-3)


def test_what_cannot_be_placed_is_refused():
    with pytest.raises(PackingError):
        people(INFILTRATION, {"particles.count": 700})


def test_a_case_knows_its_materials_skin_and_piston():
    case = case_of(INFILTRATION)
    assert case.materials == ("particles", "grains", "walls")
    assert [case.type_of(name) for name in case.materials] == [1, 2, 3]
    radii = case.population.particle_radii_m
    assert case.skin_m == pytest.approx(0.4 * radii.mean(), rel=1e-14)
    # Eq. 1: particles and the fluid between them.
    solid = case.population.particle_volume_m3
    fraction = 40 * 4 / 3 * math.pi * (0.0015**3 + 3 * 0.0015 * 0.0001**2) / (0.03 * 0.02**2)
    expected = solid * 7000.0 + solid / fraction * (1 - fraction) * 2000.0
    # The truncation at three deviations takes 3 % from the variance, 4e-4 of the volume.
    assert case.piston_mass_kg == pytest.approx(expected, rel=1e-3)
    assert case_of(INFILTRATION, {"piston.mass": 1.5}).piston_mass_kg == 1.5


def test_without_a_fluid_the_piston_weighs_what_the_particles_do():
    case = case_of(INFILTRATION, {"fluid": GONE})
    expected = 7000.0 * case.population.particle_volume_m3
    assert case.piston_mass_kg == pytest.approx(expected, rel=1e-14)


def test_materials_that_do_not_exist_have_no_number():
    assert case_of(COLLISION).materials == ("particles",)
    assert case_of(COLLISION, {"box.walls": ["z-"]}).materials == ("particles", "walls")
