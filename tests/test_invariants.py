"""Invariants from frames that a hand can write down: what they must see, and what they must not."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import pytest
from small_scenes import COLLISION, FLUID, case_of

from liggghts_driver.physics.spheres import sphere_volume_m3
from liggghts_driver.studies import invariants as module
from liggghts_driver.studies.departure import departure
from liggghts_driver.studies.energy import (
    Ran,
    drag_given_j,
    drag_taken_j,
    elastic_j,
    kinetic_j,
    work_j,
)
from liggghts_driver.studies.invariants import Invariant, changed_by, hardest, invariants_of

if TYPE_CHECKING:
    from collections.abc import Mapping

RADIUS, DENSITY = 0.0015, 7000.0
MASS = DENSITY * sphere_volume_m3(RADIUS)
TIMES = np.linspace(0.0, 0.1, 21)


def ran(
    changes: Mapping[str, Any],
    positions: Any = None,
    velocities: Any = None,
    columns: Mapping[str, Any] | None = None,
    counts: tuple[int, int] = (2, 2),
) -> Ran:
    """A made-up run of two spheres, at rest and far apart unless said otherwise."""
    case = case_of(COLLISION, changes)
    at_rest = np.zeros((len(TIMES), 2, 3))
    apart = at_rest + np.array([[-0.005, 0.0, 0.0], [0.005, 0.0, 0.0]])
    series = {"step": np.arange(len(TIMES)), "time_s": TIMES, "largest_speed_m_s": 0.0 * TIMES}
    return Ran(
        case=case,
        series=pd.DataFrame(series | dict(columns or {})),
        times_s=TIMES,
        positions_m=apart if positions is None else positions,
        velocities_m_s=at_rest if velocities is None else velocities,
        results={
            "max_overlap_over_radius": 0.0,
            "counts": {"asked": counts[0], "at_end": counts[1]},
        },
    )


def along_x(one: Any, other: Any) -> np.ndarray:
    """Places or velocities of two spheres along x, ``(frames, 2, 3)``."""
    found = np.zeros((len(TIMES), 2, 3))
    found[:, 0, 0], found[:, 1, 0] = one, other
    return found


def found(run: Ran) -> dict[str, Invariant]:
    return {each.name: each for each in invariants_of(run)}


def energy(run: Ran) -> Invariant:
    return found(run)["energy without work"]


def test_elastic_energy_of_a_pair_a_wall_and_the_piston():
    depth = 1e-5
    walls = {"box.walls": ["y-"], "piston": {"acceleration": 1.0, "mass": 0.1}}
    places = along_x(-0.02 + RADIUS - depth, -0.02 + RADIUS - depth)
    low = -0.005 + RADIUS - depth
    places[:, :, 1] = np.array([low, low + 2.0 * RADIUS - depth])
    run = ran(walls, places, columns={"piston_x_m": np.full(len(TIMES), -0.02)})
    modulus = 1e7 / (2.0 * (1.0 - 0.25**2))
    plane = 8.0 / 15.0 * modulus * math.sqrt(RADIUS) * depth**2.5
    pair = 8.0 / 15.0 * modulus * math.sqrt(RADIUS / 2.0) * depth**2.5
    # Both spheres touch the piston, one the wall, and they touch each other.
    assert elastic_j(run) == pytest.approx(np.full(len(TIMES), 3.0 * plane + pair), rel=1e-9)


def test_free_flight_keeps_energy_and_momentum():
    run = ran({}, along_x(-0.01 + 0.05 * TIMES, 0.005), along_x(0.05, 0.0))
    assert kinetic_j(run) == pytest.approx(np.full(len(TIMES), MASS * 0.05**2 / 2.0))
    held = found(run)
    assert held["energy without work"].worst == 0.0
    assert held["momentum"].worst < 1e-15
    assert not any(each.broken for each in held.values())


def test_energy_from_nowhere_is_seen_where_it_comes_again_after_a_loss():
    """Not the energy of the start is the limit, but the lowest so far."""
    speed = np.where(TIMES < 0.03, 0.05, np.where(TIMES < 0.06, 0.02, 0.04))
    run = ran({}, velocities=along_x(speed, -speed))
    assert energy(run).worst == pytest.approx((0.04**2 - 0.02**2) / 0.04**2)
    assert energy(run).broken
    assert not found(run)["momentum"].broken


def test_a_bed_that_heats_is_seen_beside_what_fell_into_it():
    """A thousandth of the speed of the start: a millionth of the energy."""
    speed = np.where(TIMES < 0.03, 0.05, 5e-5)
    assert energy(ran({}, velocities=along_x(speed, -speed))).worst == 0.0
    hot = speed * np.where(TIMES > 0.08, 1.1, 1.0)
    assert energy(ran({}, velocities=along_x(hot, -hot))).worst == pytest.approx(1 - 1 / 1.1**2)


def test_slow_growth_is_seen_in_the_whole_run():
    """By 1 % from frame to frame, too little for any tenth of the run."""
    speed = 0.05 * 1.005 ** np.arange(len(TIMES))
    grown = energy(ran({}, velocities=along_x(speed, -speed))).worst
    assert grown == pytest.approx(1.0 - 1.005**-40)


def test_what_turns_may_give_back_to_its_flight_what_it_took_and_no_more():
    """Spins are in no frame: with friction the sum at the start is the limit."""
    friction = {"contact.friction": 0.5}
    speed = np.where(TIMES < 0.03, 0.05, np.where(TIMES < 0.06, 0.03, 0.05))
    assert energy(ran(friction, velocities=along_x(speed, -speed))).worst == 0.0
    assert energy(ran({}, velocities=along_x(speed, -speed))).broken
    faster = np.where(TIMES < 0.06, 0.05, 0.06)
    grown = energy(ran(friction, velocities=along_x(faster, -faster))).worst
    assert grown == pytest.approx(1.0 - (0.05 / 0.06) ** 2)


def test_what_spins_at_the_start_may_become_flight():
    """As much as the spins had: 2/5 m r^2 w^2 / 2 each, and no more."""
    spins = [{"spin": [0.0, 0.0, 20.0]}, {"spin": [0.0, 0.0, 20.0]}]
    tables = [sphere | spin for sphere, spin in zip(COLLISION["spheres"], spins, strict=True)]
    turning = {"contact.friction": 0.5, "spheres": tables}
    flight = math.sqrt(0.01**2 + 0.4 * RADIUS**2 * 20.0**2)
    given = np.where(TIMES < 0.05, 0.01, flight)
    assert energy(ran(turning, velocities=along_x(given, -given))).worst < 1e-12
    resting = {"contact.friction": 0.5}
    assert energy(ran(resting, velocities=along_x(given, -given))).broken


def test_a_fall_is_the_weight_s_work():
    places, velocities = along_x(0.0, 0.01), np.zeros((len(TIMES), 2, 3))
    places[:, :, 2] = -0.5 * 9.81 * TIMES[:, None] ** 2
    velocities[:, :, 2] = -9.81 * TIMES[:, None]
    run = ran({"gravity": {}}, places, velocities)
    assert work_j(run) == pytest.approx(kinetic_j(run), rel=1e-12)
    assert energy(run).worst < 1e-12
    assert energy(ran({"gravity": {}}, places, 1.1 * velocities)).broken
    assert "gravity" in found(run)["momentum"].why_not


def test_the_pressure_s_work():
    """Eq. 20 over a way, everywhere in a box."""
    force = 2.0 * math.pi * RADIUS**3 * 1000.0
    way, speed = 0.5 * force / MASS * TIMES**2, force / MASS * TIMES
    run = ran(
        {"pressure": {"gradient": 1000.0}},
        along_x(-0.01 + way, 0.005 + way),
        along_x(speed, speed),
    )
    assert work_j(run)[-1] == pytest.approx(2.0 * force * way[-1])
    assert energy(run).worst < 1e-12
    other_sign = {"pressure": {"gradient": -1000.0}}
    assert energy(ran(other_sign, run.positions_m, run.velocities_m_s)).broken


def test_a_fluid_at_rest_takes_at_least_stokes_drag():
    mobility = MASS / (6.0 * math.pi * FLUID["viscosity"] * RADIUS)
    fast, slow = 0.05 * np.exp(-TIMES / mobility), np.full(len(TIMES), 0.05)
    slowing = ran({"fluid": FLUID}, velocities=along_x(fast, 0.0))
    assert not energy(slowing).broken
    taken = drag_taken_j(slowing)[-1]
    # The slower of two frames counts: less than what was taken, by a step of the sum.
    lost = kinetic_j(slowing)[0] - kinetic_j(slowing)[-1]
    assert 0.95 * lost < taken < lost
    # Ten times as viscous, a sphere cannot go on as it was.
    coasting = ran({"fluid": FLUID | {"viscosity": 0.1}}, velocities=along_x(slow, 0.0))
    assert energy(coasting).broken


def test_a_moving_fluid_may_give_as_much_as_it_can_carry():
    """A sphere that follows a fluid of constant velocity from rest: Stokes, so exp(-t/tau)."""
    viscosity, fluid = 0.5, 0.001
    tau = MASS / (6.0 * math.pi * viscosity * RADIUS)
    speed = fluid * (1.0 - np.exp(-TIMES / tau))
    tables = FLUID | {"viscosity": viscosity, "velocity_outside": "constant", "velocity": fluid}
    run = ran({"fluid": tables}, velocities=along_x(speed, speed))
    assert energy(run).worst == 0.0
    assert (drag_given_j(run) >= kinetic_j(run)).all()
    assert drag_taken_j(run)[-1] == 0.0


def test_the_piston_is_one_of_the_bodies():
    """Free, it has the work of its own force; faster than that, energy comes from nowhere."""
    piston = {"piston": {"acceleration": 1.0, "mass": 0.1}}
    place = -0.02 + 0.5 * TIMES**2
    run = ran(piston, columns={"piston_x_m": place, "piston_force_n": 0.0 * TIMES})
    # Its speed is a difference of places: half a sample late at the end.
    assert energy(run).worst < 0.05
    fast = {"piston_x_m": -0.02 + 0.75 * TIMES**2, "piston_force_n": 0.0 * TIMES}
    assert energy(ran(piston, columns=fast)).broken
    assert found(run)["piston's speed [m/s]"].worst == pytest.approx(0.0975)


def flight(share: float, **columns: Any) -> Invariant:
    """Of a piston that goes a share of the way that Newton's law has for it."""
    place = -0.02 + 0.5 * share * TIMES**2
    columns = {"piston_x_m": place, "piston_force_n": 0.0 * TIMES, **columns}
    run = ran({"piston": {"acceleration": 1.0, "mass": 0.1}}, columns=columns)
    return found(run)["free piston off a t²/2"]


def test_a_piston_too_heavy_breaks_newton_s_law_as_long_as_it_is_free():
    assert flight(1.0).worst < 1e-12
    assert flight(0.3).worst == pytest.approx(0.7)
    assert flight(0.3).broken
    # Felt a little later, a contact ends what is exact, the frame before it included.
    late = np.where(TIMES > 0.06, -1.0, 0.0)
    slower = -0.02 + np.where(TIMES > 0.06, 0.0018, 0.5 * TIMES**2)
    assert flight(1.0, piston_force_n=late, piston_x_m=slower).worst < 1e-12
    assert flight(0.3, piston_force_n=np.where(TIMES > 0.0, -1.0, 0.0)).why_not


def test_what_may_touch_the_piston_between_two_frames_ends_its_free_flight():
    speed = {"largest_speed_m_s": np.full(len(TIMES), 3.0)}
    # The first sphere is 13.5 mm away, and goes 15 mm from one frame to the next.
    assert flight(0.3, **speed).why_not == "something may touch the piston from the start"
    assert not flight(0.3, largest_speed_m_s=np.full(len(TIMES), 0.5)).why_not


def test_an_overlap_that_is_none_does_not_hold():
    run = ran({})
    run.results["max_overlap_over_radius"] = None  # as JSON has what is no number
    assert found(run)["overlap / radius"].broken


def test_what_is_no_number_and_who_is_lost():
    velocities = along_x(0.01, -0.01)
    velocities[3, 1, 2] = math.nan
    held = found(ran({}, velocities=velocities, counts=(2, 1)))
    assert held["numbers that are none"].worst == 1.0
    assert held["lost particles"].worst == 1.0
    assert held["numbers that are none"].broken
    assert held["lost particles"].broken
    assert held["energy without work"].broken  # what is not known does not hold


def test_momentum_that_changes():
    run = ran({}, velocities=along_x(np.linspace(0.05, 0.051, len(TIMES)), -0.05))
    assert found(run)["momentum"].worst == pytest.approx(0.001 / 0.101, rel=1e-6)
    assert found(run)["momentum"].broken


def test_what_says_nothing_tells_why():
    held = found(ran({"near_field": {"force": 1e-6, "reach": 1e-3}}))
    assert held["energy without work"].why_not == "the energy of attraction is not counted"
    assert held["energy without work"].share == 0.0
    walls = found(ran({"box.walls": ["x-"]}))
    assert walls["momentum"].why_not == "walls act from outside"


def test_the_hardest_is_nearest_to_its_limit():
    some = [Invariant("a", 1.0, 10.0), Invariant("b", 0.01, 0.02), Invariant("c", 9.0, 1.0, "no")]
    assert hardest(some).name == "b"
    assert hardest([*some, Invariant("lost", 1.0, 0.0)]).share == math.inf


def test_the_same_way_with_another_step():
    fine = ran({}, along_x(-0.01 + 0.05 * TIMES, 0.005))
    late = ran({}, along_x(-0.01 + 0.051 * TIMES, 0.005))
    far = ran({}, along_x(-0.01 + 0.06 * TIMES, 0.005))
    # Mean places of the second half differ by 2 % of three quarters of the way, of one of two.
    assert changed_by(late, fine).worst == pytest.approx(0.02 * 0.75, rel=1e-6)
    assert not changed_by(late, fine).broken
    assert changed_by(far, fine).broken
    assert changed_by(ran({}), ran({})).why_not == "no particle moves"


def test_of_several_particles_the_error_of_their_mean_change_is_allowed_beside(monkeypatch):
    """From the spread of the changes, not of the ways, which may differ as they like."""
    monkeypatch.setattr(module, "_SEVERAL", 2)
    fine = ran({}, along_x(-0.01 + 0.05 * TIMES, 0.005 + 0.5 * TIMES))
    same = ran({}, along_x(-0.01 + 0.05 * TIMES + 1e-3, 0.005 + 0.5 * TIMES + 1e-3))
    assert changed_by(same, fine).limit == pytest.approx(module.MOST_CHANGE)
    apart = changed_by(ran({}, along_x(-0.009 + 0.05 * TIMES, 0.004 + 0.5 * TIMES)), fine)
    scale = math.sqrt((0.005**2 + 0.05**2) / 2.0)
    # Changes of one and minus one millimetre: a mean of none, a spread of sqrt(2), over sqrt(2).
    assert apart.worst == pytest.approx(0.0, abs=1e-9)
    assert apart.limit == pytest.approx(module.MOST_CHANGE + 2.0 * 1e-3 / scale)


def test_a_departure_is_what_the_step_does_not_explain():
    sound = ran({}, along_x(-0.01 + 0.05 * TIMES, 0.005))
    fine = ran({}, along_x(-0.01 + 0.0501 * TIMES, 0.005))
    off = ran({}, along_x(-0.01 + 0.055 * TIMES, 0.005))
    assert departure(off, sound, fine).worst == pytest.approx(0.1)
    assert departure(off, sound, fine).broken
    # Of what is less than ten times as far off as with half the step nothing is said.
    assert departure(ran({}, along_x(-0.01 + 0.0509 * TIMES, 0.005)), sound, fine).worst == 0.0
    assert departure(off, ran({}), ran({})).why_not == "no particle moves"


def test_a_departure_is_seen_although_chaos_comes_later():
    """Half the way long both runs are told apart; then even half the step changes everything."""
    late = np.where(TIMES < 0.05, 0.0, 0.02)
    sound = ran({}, along_x(-0.01 + 0.05 * TIMES, 0.005))
    fine = ran({}, along_x(-0.01 + 0.0501 * TIMES + late, 0.005))
    off = ran({}, along_x(-0.01 + 0.055 * TIMES - late, 0.005))
    assert departure(off, sound, fine).worst == pytest.approx(0.1)
