"""The formulas of a deck, evaluated as the engine does, against the physics they stand for."""

from __future__ import annotations

import functools
import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from decks import commands, deck_of, evaluate, taken_up, variables
from hypothesis import given, settings
from hypothesis import strategies as st
from small_scenes import COLLISION, FLUID, INFILTRATION, case_of

from liggghts_driver.effects.drag_law import drag_factor_formula, reynolds_bound
from liggghts_driver.flowing import flowing_threshold_m_s
from liggghts_driver.physics.drag import BRANCHES, drag_coefficient_n_s_m, drag_factor
from liggghts_driver.prediction import predict

BOUNDS = [branch.up_to for branch in BRANCHES]
RHO, MU = FLUID["density"], FLUID["viscosity"]


def atom(**words: float) -> dict[str, float]:
    """An atom at rest at x = 0.01 with the paper's radius, changed."""
    rest = {"x": 0.01, "y": 0.0, "z": 0.0, "vx": 0.0, "vy": 0.0, "vz": 0.0, "r": 0.0015}
    return {**rest, **words}


@given(st.sampled_from(BOUNDS), st.floats(-6, 8))
@settings(deadline=None)
def test_drag_factor_over_all_branches(bound, exponent):
    re = 10.0**exponent
    formula = drag_factor_formula(bound, "v_re2")
    value = evaluate(formula, {}, {"v_re2": re**2})
    # Up to the bound the formula is the law; beyond it, the law's last branch goes on.
    if re <= bound:
        assert value == pytest.approx(float(drag_factor(re)), rel=1e-12)
    else:
        branch = BRANCHES[BOUNDS.index(bound)]
        assert value == pytest.approx(branch.factor * re**branch.power, rel=1e-12)


@pytest.mark.parametrize(
    ("bound", "re"), [(bound, re) for bound in BOUNDS for re in BOUNDS[:-1] if re < bound], ids=str
)
def test_drag_factor_at_the_bounds_themselves(bound, re):
    formula = drag_factor_formula(bound, "v_re2")
    for near in (re * (1 - 1e-9), re, re * (1 + 1e-9)):
        value = evaluate(formula, {}, {"v_re2": near**2})
        assert value == pytest.approx(float(drag_factor(near)), rel=1e-12)


@pytest.mark.parametrize(
    ("bound", "branches"), list(zip(BOUNDS, range(1, 6), strict=True)), ids=str
)
def test_branches_out_of_reach_are_left_out(bound, branches):
    terms = drag_factor_formula(bound, "v_re2").split("+(v")
    assert len(terms) == branches


def test_stokes_drag_is_no_formula_at_all():
    assert drag_factor_formula(1.0, "v_re2") == "1.0"


def test_the_law_of_a_deck_reaches_as_far_as_its_particles_may():
    case = case_of(INFILTRATION)
    reached = 2 * RHO * case.population.particle_radii_m.max() * case.speed_bound_m_s / MU
    assert reynolds_bound(case) >= reached
    assert reynolds_bound(case) in BOUNDS
    slow = case_of(INFILTRATION, {"fluid.viscosity": 10.0, "fluid.velocity_outside": "still"})
    assert reynolds_bound(slow) == 1.0


#: Changes of the infiltration scene, and the fluid's velocity at x and t that they mean.
FLUIDS = {
    "still": ({"fluid.velocity_outside": "still"}, lambda x, t: 0.0),
    "constant": (
        {"fluid.velocity_outside": "constant", "fluid.velocity": 0.03},
        lambda x, t: 0.03 if x < 0 else 0.0,
    ),
    "backwards": (
        {"fluid.velocity_outside": "constant", "fluid.velocity": -0.03},
        lambda x, t: -0.03 if x < 0 else 0.0,
    ),
    "accelerating": (
        {"fluid.velocity_outside": "accelerating"},
        lambda x, t: 2.143e-3 * t if x < 0 else 0.0,
    ),
    "own acceleration": (
        {"fluid.velocity_outside": "accelerating", "fluid.acceleration": 0.5},
        lambda x, t: 0.5 * t if x < 0 else 0.0,
    ),
    "piston": (
        {"fluid.velocity_outside": "piston"},
        lambda x, t: 0.02 + 0.003 * t if x < 0 else 0.0,
    ),
}


def clock(time: float) -> dict[str, float]:
    """What a deck knows of the time, and of a piston that nothing has touched for long."""
    piston = {"v_piston_velocity": 0.02 + 0.003 * time, "v_piston_acceleration": 0.003}
    return {"v_time": time, **piston}


def slip_at(re: float, radius: float, angle: float, height: float) -> np.ndarray:
    """A velocity of some Reynolds number, in any direction."""
    speed = re * MU / (2 * RHO * radius)
    across = math.sqrt(1 - height**2)
    return speed * np.array([height, across * math.cos(angle), across * math.sin(angle)])


@pytest.mark.parametrize("fluid", FLUIDS)
@pytest.mark.parametrize("inside", ["still", "pore"])
@pytest.mark.parametrize("scheme", ["exact", "held"])
@given(data=st.data())
@settings(max_examples=40, deadline=None)
def test_drag_at_present_is_eqs_17_to_19(fluid, inside, scheme, data):
    """The force of the exact scheme, and the Reynolds number that any scheme tells of."""
    case, known = formulas_of(fluid, inside, scheme)
    x = data.draw(st.sampled_from([-0.02, -1e-9, 0.0, 1e-9, 0.01]))
    time = data.draw(st.floats(0, 50))
    radius = data.draw(st.floats(0.0012, 0.0018))
    # Any slip up to the Reynolds number at which the deck's law ends, in any direction.
    re = data.draw(st.floats(1e-3, 1.0)) * 0.999 * reynolds_bound(case)
    slip = slip_at(re, radius, data.draw(st.floats(0, 6.3)), data.draw(st.floats(-1, 1)))
    speed = re * MU / (2 * RHO * radius)
    pore = predict(case.scene).pore_velocity_m_s if inside == "pore" else 0.0
    flow = FLUIDS[fluid][1](x, time) if x < 0 else pore
    here = atom(x=x, vx=slip[0] + flow, vy=slip[1], vz=slip[2], r=radius) | clock(time)
    assert evaluate(known["re2"], known, here) == pytest.approx(re**2, rel=1e-6)
    if scheme == "held":
        return
    coefficient = float(drag_coefficient_n_s_m(RHO, MU, radius, speed))
    force = [evaluate(known[f"drag_{axis}"], known, here) for axis in "xyz"]
    # Rounding of v - v_f: both are below 60 m/s, and the slip above 2e-7 m/s.
    assert force == pytest.approx(-coefficient * slip, rel=1e-6, abs=1e-6 * coefficient * speed)
    assert evaluate(known["drag"], known, here) == pytest.approx(coefficient, rel=1e-6)


def refreshed(known: dict[str, str], here: dict[str, float], last: np.ndarray) -> dict[str, float]:
    """What a deck has set of one atom after a refresh, in the order of its commands."""
    held = here | {f"f_earlier[{n}]": value for n, value in enumerate(last, start=1)}
    for name in ("stokes", "re2_per_slip2", "pressure"):
        held[f"f_{name}"] = evaluate(known[name], known, here)
    slip = [evaluate(known[f"slip_{axis}"], known, held) for axis in "xyz"]
    held |= {f"f_slip[{n}]": value for n, value in enumerate(slip, start=1)}
    held["f_slip_re2"] = evaluate(known["slip_re2"], known, held)
    held["f_coefficient"] = evaluate(known["kept_drag"], known, held)
    return held


@pytest.mark.parametrize("refresh", [None, 1e-3, 1e-9], ids=["own", "short", "every step"])
@pytest.mark.parametrize("fluid", FLUIDS)
@pytest.mark.parametrize("inside", ["still", "pore"])
@given(data=st.data())
@settings(max_examples=40, deadline=None)
def test_a_held_force_is_eqs_17_to_20_at_the_middle_of_its_interval(fluid, inside, refresh, data):
    case, known = formulas_of(fluid, inside, "held", refresh)
    step, every = case.time.step_s, case.time.refresh_every
    # The engine kicks with half of the old force and half of the new: half a step late.
    ahead = (every / 2 + 1 / 2) * step
    place = data.draw(st.sampled_from([-0.02, -1e-9, 0.0, 1e-9, 0.01]))
    time, radius = data.draw(st.floats(0, 50)), data.draw(st.floats(0.0012, 0.0018))
    re = data.draw(st.floats(1e-3, 1.0)) * 0.999 * reynolds_bound(case)
    slip = -slip_at(re, radius, data.draw(st.floats(0, 6.3)), data.draw(st.floats(-1, 1)))
    pore = predict(case.scene).pore_velocity_m_s if inside == "pore" else 0.0
    flow = FLUIDS[fluid][1](place, time + ahead) if place < 0 else pore
    # The particle comes to that place and slip by what it has now and had at the last refresh.
    vx = 0.0 if place == 0.0 else data.draw(st.floats(-0.1, 0.1))
    velocity = np.array([vx, data.draw(st.floats(-0.1, 0.1)), data.draw(st.floats(-0.1, 0.1))])
    then = np.array([flow, 0.0, 0.0]) - slip
    last = velocity - (then - velocity) * every * step / ahead
    here = atom(x=place - ahead * vx, r=radius) | clock(time)
    here |= dict(zip(("vx", "vy", "vz"), velocity.tolist(), strict=True))
    held = refreshed(known, here, last)
    speed = float(np.linalg.norm(slip))
    coefficient = float(drag_coefficient_n_s_m(RHO, MU, radius, speed))
    pressure = 2 * math.pi * radius**3 * 10.0 if place >= 0 else 0.0
    expected = coefficient * slip + np.array([pressure, 0.0, 0.0])
    force = [evaluate(known[f"kept_{axis}"], known, held) for axis in "xyz"]
    # Rounding of v_f - v: velocities are below 60 m/s, and the slip above 2e-7 m/s.
    assert force == pytest.approx(expected, rel=1e-6, abs=1e-6 * coefficient * speed)
    assert held["f_slip_re2"] == pytest.approx(re**2, rel=1e-6)
    assert held["f_coefficient"] == pytest.approx(coefficient, rel=1e-6)


@pytest.mark.parametrize("scheme", ["held", "implicit"])
@pytest.mark.parametrize("refresh", [None, 1e-3, 1e-9], ids=["own", "short", "every step"])
def test_velocities_are_weighed_for_half_a_step_after_half_the_interval(scheme, refresh):
    case, known = formulas_of("still", "still", scheme, refresh)
    every = case.time.refresh_every
    assert (every == 1) == (refresh == 1e-9)
    assert every < 40 or refresh is None
    ahead = (every + 1) / (2 * every)
    for number, axis in enumerate("xyz", start=1):
        last = {f"f_earlier[{n}]": 0.0 for n in (1, 2, 3)}
        now = evaluate(known[f"slip_{axis}"], known, atom(**{f"v{axis}": 1.0}) | last)
        assert now == pytest.approx(-(1 + ahead), rel=1e-12)
        before = atom() | last | {f"f_earlier[{number}]": 1.0}
        assert evaluate(known[f"slip_{axis}"], known, before) == pytest.approx(ahead, rel=1e-12)
        # Before the first refresh both are the same: the slip is the present one.
        same = atom(**{f"v{axis}": 1.0}) | last | {f"f_earlier[{number}]": 1.0}
        assert evaluate(known[f"slip_{axis}"], known, same) == pytest.approx(-1.0, rel=1e-12)


@functools.cache
def formulas_of(fluid, inside, scheme, refresh=None):
    """The case of a combination and the formulas of its deck, made once."""
    changes = {**FLUIDS[fluid][0], "fluid.velocity_inside": inside, "drag.scheme": scheme}
    changes |= {} if refresh is None else {"drag.refresh": refresh}
    case = case_of(INFILTRATION, changes)
    return case, variables(deck_of(case).files["deck.in"])


def settings_of(deck: str) -> list[list[str]]:
    """The ``set`` commands of a script, as words: those before the run, or after every piece."""
    return [words for words in commands(deck) if words[0] == "set"]


@pytest.mark.parametrize("fluid", FLUIDS)
@pytest.mark.parametrize("inside", ["still", "pore"])
@pytest.mark.parametrize("script", ["deck.in", "pieces.in"])
def test_implicit_drag_is_set_from_the_same_law(fluid, inside, script):
    _, outside_velocity = FLUIDS[fluid]
    case, known = formulas_of(fluid, inside, "implicit")
    deck = deck_of(case).files[script]
    pore = predict(case.scene).pore_velocity_m_s if inside == "pore" else 0.0
    moving = any(outside_velocity(-1, t) for t in (0, 1))
    # K from the slip to the velocity that the property uf holds, at the middle of the interval.
    ahead = (case.time.refresh_every + 1) / 2 * case.time.step_s
    now, last = np.array([0.02, 0.01, 0.0]), np.array([0.018, 0.011, 0.001])
    then = now + (now - last) / (case.time.refresh_every * case.time.step_s) * ahead
    held = refreshed(known, atom(vx=0.02, vy=0.01) | {"f_uf[1]": 0.005}, last)
    flow = 0.005 if moving or pore else 0.0
    slip = np.array([flow, 0.0, 0.0]) - then
    expected = float(drag_coefficient_n_s_m(RHO, MU, 0.0015, float(np.linalg.norm(slip))))
    assert held["f_coefficient"] == pytest.approx(expected, rel=1e-12)
    assert [held[f"f_slip[{n}]"] for n in (1, 2, 3)] == pytest.approx(slip, rel=1e-12)
    assert ["set", "group", "particles", "property/atom", "Ksl", "v_kept_drag"] in settings_of(deck)
    assert ("f_uf[1]" in known["re2"]) == ("f_uf[1]" in known["slip_x"]) == (moving or pore != 0)
    # uf is that of the middle of the coming interval.
    if moving:
        value = evaluate(known["fluid_velocity"], known, clock(3.0))
        assert value == pytest.approx(outside_velocity(-1, 3.0 + ahead), rel=1e-12)
    velocities = {tuple(w[1:3]): w[5:] for w in settings_of(deck) if w[4] == "uf"}
    assert ["set", "group", "particles", "property/atom", "slip"] in [
        w[:5] for w in settings_of(deck)
    ]
    if moving or pore:
        assert [float(v) for v in velocities["region", "inside"]] == [pore, 0.0, 0.0]
        outside = velocities["region", "outside"]
        assert outside == (["$(v_fluid_velocity)" if moving else "0.0", "0.0", "0.0"])
    else:
        assert not velocities


def test_pressure_force_is_eq_20():
    for scheme in ("implicit", "held", "exact"):
        _, known = formulas_of("still", "still", scheme)
        value = evaluate(known["pressure"], known, atom(r=0.0013))
        # 2 r grad p times pi r^2.
        assert value == pytest.approx(2 * 0.0013 * 10.0 * math.pi * 0.0013**2, rel=1e-12)


@pytest.mark.parametrize("scheme", ["implicit", "held", "exact"])
def test_pressure_acts_inside_the_specimen_alone_and_everywhere_in_a_box(scheme):
    case, _ = formulas_of("still", "still", scheme)
    inside = deck_of(case).files["deck.in"]
    box = deck_of(
        case_of(COLLISION, {"fluid": FLUID, "pressure.gradient": 10.0, "drag.scheme": scheme})
    ).files["deck.in"]
    assert not [words for words in commands(box) if words[0] == "region"]
    limits = [w[3:] for w in commands(inside) if w[0] == "region" and w[1] != "outside"]
    if scheme == "held":
        # Where a particle is at the middle of the interval, is part of the formula.
        assert not limits
        moving = atom(vx=0.01) | {f"f_slip[{n}]": 0.0 for n in (1, 2, 3)} | {"f_coefficient": 1.0}
        ahead = 0.01 * (case.time.refresh_every + 1) / 2 * case.time.step_s
        for x, pressed in [(-1.001 * ahead, 0.0), (-0.999 * ahead, 3.0), (1.0, 3.0)]:
            there = moving | {"x": x, "f_pressure": 3.0}
            known = variables(inside)
            assert [evaluate(known[f"kept_{a}"], known, there) for a in "xyz"] == [pressed, 0, 0]
        known = variables(box)
        assert evaluate(known["kept_x"], known, moving | {"x": -1.0, "f_pressure": 3.0}) == 3.0
        return
    assert limits == [["0.0", *["INF"] * 5, "units", "box"]]
    for script in ("deck.in", "pieces.in") if scheme == "implicit" else ():
        commanded = settings_of(deck_of(case).files[script])
        set_there = {tuple(w[1:3]): w[5:] for w in commanded if w[4] == "dragforce"}
        assert set_there["region", "outside"] == ["0.0", "0.0", "0.0"]
        assert set_there["region", "inside"] == ["v_pressure_x", "v_zero", "v_zero"]


@given(st.floats(-0.03, 0.03), st.floats(-0.01, 0.01), st.floats(0.001, 0.002))
@settings(deadline=None)
def test_counting(x, vx, radius):
    case, known = formulas_of("still", "still", "exact")
    here = atom(x=x, vx=vx, r=radius)
    threshold = flowing_threshold_m_s(case.scene)
    inside, flows = 0 < x < 0.02, 0 < x < 0.02 and vx > threshold
    assert evaluate(known["inside"], known, here) == inside
    assert evaluate(known["flows"], known, here) == flows
    assert evaluate(known["flow_velocity"], known, here) == (vx if flows else 0.0)
    volume = 4 / 3 * math.pi * radius**3
    for name, place in (("entrance", 0.0), ("middle", 0.01)):
        expected = volume if x > place else 0.0
        assert evaluate(known[f"past_{name}"], known, here) == pytest.approx(expected, rel=1e-12)
    assert evaluate(known["speed"], known, here | {"vy": 0.1, "vz": -0.2}) == pytest.approx(
        math.hypot(vx, 0.1, 0.2), rel=1e-12
    )


def running_mean(known: dict[str, str], then: int, forces: list[float]) -> dict[str, float]:
    """What ``fix ave/time ... ave running`` tells after these steps: the first is ``then``."""
    counted = [
        [
            evaluate(known[name], known, {"step": step, "f_piston[1]": force})
            for name in ("piston_force", "piston_steps")
        ]
        for step, force in enumerate(forces, start=then)
    ]
    means = np.mean(counted, axis=0)
    return {f"f_piston_mean[{n}]": mean for n, mean in enumerate(means, start=1)}


@pytest.mark.parametrize("checkpoint", [None, 0.02, -0.004, 0.0], ids=str)
@pytest.mark.parametrize("steps", [0, 1, 2, 1000])
def test_the_pistons_velocity_is_newtons_law(checkpoint, steps):
    """From the start, and from a checkpoint at which it had some velocity."""
    case = case_of(INFILTRATION)
    if checkpoint is not None:
        case = taken_up(case, 2, checkpoint)
    then = case.checkpoint.step if case.checkpoint else 0
    known = variables(deck_of(case).files["deck.in"])
    mass, step = case.piston_mass_kg, case.time.step_s
    # Any forces, that of the start among them: it belongs to the step that ended there.
    forces = np.random.default_rng(1).normal(0.0, 0.3 * mass, steps + 1).tolist()
    given = {"step": then + steps, **running_mean(known, then, forces)}
    kicks = step * (2.143e-3 + np.array(forces[1:]) / mass)
    expected = (checkpoint or 0.0) + math.fsum(kicks)
    velocity = evaluate(known["piston_velocity"], known, given)
    # Rounding of a sum of so many terms.
    largest = abs(checkpoint or 0.0) + np.abs(kicks).sum()
    assert velocity == pytest.approx(expected, rel=0, abs=1e-12 * largest)


def test_the_last_force_on_the_piston_may_not_be_counted_yet():
    """When the mean is asked for before it has the present step, it is no mean of fewer forces."""
    case = case_of(INFILTRATION)
    known = variables(deck_of(case).files["deck.in"])
    mass, step = case.piston_mass_kg, case.time.step_s
    forces = [0.0, *(-0.1 * mass * n for n in range(1, 10))]
    given = {"step": 10, **running_mean(known, 0, forces)}
    velocity = evaluate(known["piston_velocity"], known, given)
    assert velocity == pytest.approx(step * (10 * 2.143e-3 - 0.1 * 45), rel=1e-12)


@pytest.mark.parametrize("checkpoint", [False, True])
def test_the_piston_is_averaged_over_all_steps_and_over_an_interval(checkpoint):
    case = taken_up(case_of(INFILTRATION)) if checkpoint else case_of(INFILTRATION)
    deck, every = deck_of(case).files["deck.in"], case.time.refresh_every
    fixes = {w[1]: w[3:] for w in commands(deck) if w[0] == "fix"}
    mean = "ave/time 1 1 1 v_piston_force v_piston_steps ave running"
    assert " ".join(fixes["piston_mean"]) == mean
    assert " ".join(fixes["piston_recent"]) == f"ave/time 1 {every} {every} f_piston[1]"
    known, mass = variables(deck), case.piston_mass_kg
    acceleration = evaluate(known["piston_acceleration"], known, {"f_piston_recent": 0.1 * mass})
    assert acceleration == pytest.approx(2.143e-3 + 0.1, rel=1e-12)


@pytest.mark.parametrize("velocity", [0.02, -0.004])
def test_a_resumed_servo_gets_the_integral_of_its_velocity(velocity):
    """The engine: v = vel_max ki / |F| x integral of (target + contacts) dt."""
    case = taken_up(case_of(INFILTRATION), 2, velocity)
    deck, then = deck_of(case).files["deck.in"], case.checkpoint.step
    known, lines = variables(deck), commands(deck)
    (servo,) = [w for w in lines if w[:2] == ["fix", "piston"]]
    words = dict(itertools.pairwise(servo))
    assert words["target_val"] == "v_piston_target"
    back = next(int(w[1]) for w in lines if w[0] == "reset_timestep")
    (at,) = [n for n, w in enumerate(lines) if w[:2] == ["run", "2"]]
    assert lines[at - 1][0] == "timestep"
    no_time = float(lines[at - 1][1])
    first, second, *rest = (
        evaluate(known["piston_target"], known, {"step": float(step)})
        for step in range(back + 1, back + 10)
    )
    # From the second of the two steps on it is the force alone, the last to tell the velocity.
    force = case.piston_mass_kg * 2.143e-3
    assert back + 2 == then
    assert [second, *rest] == [pytest.approx(force, rel=1e-12)] * 8
    integral = (first + second) * no_time
    gain = float(words["vel_max"]) * float(words["ki"]) / second
    assert gain * integral == pytest.approx(velocity, rel=1e-12)
    # Its place does not change meanwhile, not by the last digit.
    place = float(servo[servo.index("com") + 1])
    assert place + 2 * no_time * velocity == place


@pytest.mark.parametrize("resumed", [False, True])
def test_a_piston_that_was_at_rest_has_its_force_as_a_number(resumed):
    case = case_of(INFILTRATION)
    case = taken_up(case, 1, 0.0) if resumed else case
    deck = deck_of(case).files["deck.in"]
    (servo,) = [w for w in commands(deck) if w[:2] == ["fix", "piston"]]
    force = float(servo[servo.index("target_val") + 1])
    assert force == pytest.approx(case.piston_mass_kg * 2.143e-3, rel=1e-12)
    assert "piston_target" not in variables(deck)


MOTION = st.floats(-1.0, 1.0)
#: The moment of inertia of a sphere is 2/5 m r^2.
KINDS = {
    "": ("v", "f", lambda mass, radius: mass),
    "spin_": ("omega", "tq", lambda mass, radius: 0.4 * mass * radius**2),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("axis", "xyz")
@pytest.mark.parametrize("number", [1, 2])
@given(now=MOTION, force=MOTION, other=MOTION, mass=st.floats(0.1, 10), radius=st.floats(0.1, 10))
@settings(max_examples=30, deadline=None)
def test_a_checkpoint_and_what_goes_on_from_it(kind, axis, number, now, force, other, mass, radius):
    """Half a step back in the file; then the half kick that would have come, whatever the force.

    The forces that are computed again are others where drag was renewed in between.
    """
    case, before, after = checkpoint_formulas(number)
    word, cause, inertia = KINDS[kind]
    here = {"mass": mass, "r": radius, f"{word}{axis}": now, f"{cause}{axis}": force}
    kick = 0.5 * case.time.step_s / inertia(mass, radius)
    # Rounding of a sum of terms of this size.
    near = {"rel": 0, "abs": 1e-14 * (1.0 + kick)}
    half = evaluate(before[f"{kind}half_{axis}"], before, here)
    assert half == pytest.approx(now - kick * force, **near)
    place = "xyz".index(axis) + 1
    stored = {f"f_{kind}full_{number}[{place}]": now, f"f_{kind}half_{number}[{place}]": half}
    again = {"mass": mass, "r": radius, f"{cause}{axis}": other, **stored}
    assert evaluate(after[f"{kind}full_{axis}"], after, again) == now
    start = evaluate(after[f"{kind}start_{axis}"], after, again)
    assert start == pytest.approx(2 * now - half - kick * other, **near)
    assert start + kick * other == pytest.approx(now + kick * force, **near)


@functools.cache
def checkpoint_formulas(number):
    """A case that turns; the formulas of its checkpoint, first or second, and of what follows."""
    case = case_of(INFILTRATION, {"contact.friction": 0.2})
    before = case if number == 1 else taken_up(case, number - 1)
    after = replace(before, checkpoint=taken_up(case, number).checkpoint)
    checkpoint = variables(deck_of(before).files["checkpoint.in"])
    return case, checkpoint, variables(deck_of(after).files["deck.in"])


def test_gravity_and_buoyancy_point_the_right_way():
    gravity = [0.3, -0.4, -1.2]
    case = case_of(COLLISION, {"gravity": {"acceleration": gravity}, "fluid": FLUID})
    lines = {w[1]: w for w in commands(deck_of(case).files["deck.in"]) if w[0] == "fix"}
    for name, factor in (("gravity", 1.0), ("buoyancy", -RHO / 7000.0)):
        words = lines[name]
        magnitude, vector = float(words[4]), np.array([float(word) for word in words[6:9]])
        applied = magnitude * vector / np.linalg.norm(vector)  # the engine normalises the vector
        assert applied == pytest.approx(factor * np.array(gravity), rel=1e-12)


def test_flowing_threshold():
    case = case_of(INFILTRATION)
    # A tenth of the free flight at 10 Pa/m, 2.77 mm/s with three digits (physics.md).
    assert flowing_threshold_m_s(case.scene) == pytest.approx(2.77e-4, rel=0.002)
    own = case_of(INFILTRATION, {"output.flowing_above": 1e-3})
    assert flowing_threshold_m_s(own.scene) == 1e-3
    assert flowing_threshold_m_s(case_of(COLLISION).scene) == 0.0


@pytest.mark.parametrize("scheme", ["implicit", "exact", "held"])
def test_pressure_goes_on_behind_an_open_exit(scheme):
    """So that what leaves moves on and does not dam the exit (docs/how-it-works.md)."""
    case = case_of(INFILTRATION, {"specimen.exit": "open", "drag.scheme": scheme})
    deck = deck_of(case).files["deck.in"]
    lines = commands(deck)
    if scheme == "held":
        behind = atom(x=0.5, vx=0.1) | {"f_slip[1]": 0.0, "f_coefficient": 1.0, "f_pressure": 3.0}
        assert evaluate(variables(deck)["kept_x"], {}, behind) == 3.0
        return
    (region,) = [w for w in lines if w[0] == "region" and w[1] in {"inside", "specimen"}]
    assert region[3:5] == ["0.0", "INF"]
