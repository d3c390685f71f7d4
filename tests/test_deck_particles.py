"""The engine's data file holds every sphere to the last bit, inside a box with room."""

from __future__ import annotations

import numpy as np
import pytest
from small_scenes import COLLISION, INFILTRATION, case_of

from liggghts_driver.deck.particles import particle_data, simulation_box


def read(text: str):
    """The data file: counts, box (3, 2), atoms (n, 7), velocities (n, 7) or None."""
    head, *sections = text.split("\n\nAtoms\n\n")
    lines = head.splitlines()
    counts = {line.split(maxsplit=1)[1]: int(line.split()[0]) for line in lines[2:4]}
    box = np.array([[float(word) for word in line.split()[:2]] for line in lines[4:7]])
    assert [line.split()[2:] for line in lines[4:7]] == [[f"{a}lo", f"{a}hi"] for a in "xyz"]
    if not sections:
        return counts, box, np.empty((0, 7)), None
    parts = sections[0].split("\n\nVelocities\n\n")
    tables = [np.array([line.split() for line in part.splitlines()], float) for part in parts]
    return counts, box, tables[0], tables[1] if len(tables) > 1 else None


def test_round_trip():
    case = case_of(INFILTRATION, {"grains.density": 3000.0})
    population = case.population
    counts, box, atoms, velocities = read(particle_data(case))
    assert counts == {"atoms": len(population.radii_m), "atom types": 3}
    assert box.tolist() == [list(pair) for pair in simulation_box(case)]
    assert atoms[:, 0].tolist() == list(range(1, len(population.radii_m) + 1))
    particle = np.arange(len(atoms)) < 40
    assert (atoms[:, 1] == np.where(particle, 1, 2)).all()
    assert np.array_equal(atoms[:, 2], 2 * population.radii_m)  # the engine wants diameters
    assert (atoms[:, 3] == np.where(particle, 7000.0, 3000.0)).all()
    assert np.array_equal(atoms[:, 4:], population.centres_m)
    assert velocities is None


def test_velocities_and_spins():
    spheres = [{**COLLISION["spheres"][0], "spin": [1.0, 0.1, -3.0]}, COLLISION["spheres"][1]]
    *_, velocities = read(particle_data(case_of(COLLISION, {"spheres": spheres})))
    assert velocities.tolist() == [
        [1, 0.005, 0, 0, 1.0, 0.1, -3.0],
        [2, -0.005, 0, 0, 0, 0, 0],
    ]


def test_grains_without_a_density_get_the_particles():
    *_, atoms, _ = read(particle_data(case_of(INFILTRATION)))
    assert set(atoms[:, 3]) == {7000.0}


def test_an_open_box_is_the_engines_box():
    case = case_of(COLLISION)
    assert simulation_box(case) == [(-0.02, 0.02), (-0.005, 0.005), (-0.005, 0.005)]


@pytest.mark.parametrize("changes", [{}, {"specimen.exit": "open"}, {"piston.mass": 1.0}], ids=str)
def test_the_engines_box_has_room_for_all_that_sticks_out(changes):
    case = case_of(INFILTRATION, changes)
    box, population = np.array(simulation_box(case)), case.population
    radii = population.radii_m[:, None]
    assert (population.centres_m - radii > box[:, 0]).all()
    assert (population.centres_m + radii < box[:, 1]).all()
    assert (np.array(case.layout.low) - case.skin_m > box[:, 0]).all()
    assert (np.array(case.layout.high) + case.skin_m < box[:, 1]).all()
    # The piston's surface reaches a twentieth of the width beyond the walls.
    width = np.subtract(case.layout.high, case.layout.low)[1:]
    assert (box[1:, 1] > np.array(case.layout.high)[1:] + 0.05 * width).all()


def test_walls_give_a_box_room_too():
    case = case_of(COLLISION, {"box.walls": ["z-"]})
    box = np.array(simulation_box(case))
    assert box[2, 0] < -0.005


def test_an_open_face_stays_where_the_scene_puts_it():
    """As its docstring says: a particle that leaves is lost, and the run says so."""
    case = case_of(COLLISION, {"box.walls": ["z-"]})
    assert simulation_box(case)[0] == (-0.02, 0.02)


def test_a_piston_has_room_in_a_box_without_walls():
    case = case_of(COLLISION, {"piston": {"acceleration": 1.0, "mass": 1.0}})
    (_, _), (y_low, _), _ = simulation_box(case)
    assert y_low < -0.005 * (1 + 2 * 0.05)
