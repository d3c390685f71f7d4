"""The time step: every contact is resolved, every bound named, and the intervals fit together."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
import pytest
from hypothesis import assume, given, reject, settings
from hypothesis import strategies as st
from small_scenes import COLLISION, FLUID, GONE, GRAIN, INFILTRATION, MATERIAL, case_of, shipped

from liggghts_driver.bounds import contact_bounds
from liggghts_driver.case import make_case
from liggghts_driver.effects.piston import speed_limit_m_s
from liggghts_driver.errors import SceneError
from liggghts_driver.loads import pressing_force_n
from liggghts_driver.physics.contact import Body, contact_duration_s
from liggghts_driver.physics.drag import drag_coefficient_n_s_m, free_flight_speed_m_s
from liggghts_driver.scene import make_scene
from liggghts_driver.timestep import TimePlan, frame_steps

GRAINS = {"youngs_modulus": 1.0e6, "poissons_ratio": 0.25}
SETTLING = shipped("settling_sphere")


def bound(case, name: str):
    return next(bound for bound in case.time.bounds if bound.name == name)


def bodies(case) -> list[Body]:
    """Every sphere as a body; a wall at the end if there is one."""
    scene, population = case.scene, case.population
    found = []
    for row, radius in enumerate(population.radii_m.tolist()):
        mover = row < population.particles
        table = scene.particles if mover else scene.grains
        mass = scene.particles.density * 4 / 3 * math.pi * radius**3 if mover else math.inf
        found.append(Body(radius, mass, table.youngs_modulus, table.poissons_ratio))
    if case.layout.walls or scene.piston:
        walls, particles = scene.walls, scene.particles
        modulus = walls.youngs_modulus or particles.youngs_modulus
        found.append(Body(math.inf, math.inf, modulus, particles.poissons_ratio))
    return found


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"particles.radius_deviation": 0.0004},
        {"walls": {"youngs_modulus": 1e9}},
        pytest.param({"grains.radius_deviation": 0.001}),
    ],
    ids=str,
)
def test_no_contact_of_any_two_spheres_is_shorter_than_the_bound(changes):
    case = case_of(INFILTRATION, changes)
    speed = case.speed_bound_m_s
    everyone = bodies(case)
    movers = everyone[: case.population.particles]
    shortest = min(
        contact_duration_s(mover, other, speed)
        for index, mover in enumerate(movers)
        for other in everyone[index + 1 :]
    )
    found = contact_bounds(case.scene, case.layout, case.population, speed)
    # The smallest particle is taken twice, though there may be one of its size only: with the
    # radii of these scenes that is 12 % below the shortest contact at most.
    assert 0.85 * 0.1 * shortest <= min(bound.step_s for bound in found) <= 0.1 * shortest
    grain = [
        contact_duration_s(mover, body, speed)
        for mover in movers
        for body in everyone[case.population.particles : len(case.population.radii_m)]
    ]
    (of_grains,) = [bound.step_s for bound in found if "grain" in bound.name]
    assert of_grains <= 0.1 * min(grain) * (1 + 1e-12)


def test_bounds_are_sorted_and_explained():
    case = case_of(INFILTRATION, {"drag.scheme": "exact"})
    names = [bound.name for bound in case.time.bounds]
    assert set(names) == {
        "contact particle-particle", "contact particle-grain", "contact particle-wall",
        "pressed particle-particle", "pressed particle-grain", "pressed particle-wall",
        "drag", "piston", "duration",
    }  # fmt: skip
    steps = [bound.step_s for bound in case.time.bounds]
    assert steps == sorted(steps)
    assert case.time.bound_s == steps[0]
    assert "Eq. 21" in bound(case, "contact particle-wall").reason
    assert bound(case, "duration").step_s == pytest.approx(1.0 / 20, rel=1e-14)


def test_the_step_follows_the_asked_fraction():
    one, two = (case_of(COLLISION, {"time.step_fraction": f}) for f in (0.1, 0.02))
    ratio = (
        bound(one, "contact particle-particle").step_s
        / bound(two, "contact particle-particle").step_s
    )
    assert ratio == pytest.approx(5.0, rel=1e-12)


@pytest.mark.parametrize("scheme", ["implicit", "held", "exact"])
def test_explicit_drag_bounds_the_step(scheme):
    case = case_of(SETTLING, {"drag.scheme": scheme, "time.step": GONE})
    drag = [bound for bound in case.time.bounds if bound.name == "drag"]
    if scheme == "implicit":
        assert not drag
        return
    mass = 7000.0 * 4 / 3 * math.pi * 0.0015**3
    # The speed bound is for two particles that meet head-on; the fluid is not one of them.
    slip = case.speed_bound_m_s / 2
    coefficient = float(drag_coefficient_n_s_m(2000.0, 1e-3, 0.0015, slip))
    # K dt / m below 0.1.
    assert drag[0].step_s == pytest.approx(0.1 * mass / coefficient, rel=1e-12)


class TestSpeedBound:
    """No relative speed of a contact may exceed it: each cause alone, twice."""

    def test_initial_speeds(self):
        spheres = [
            {"radius": 1e-3, "position": [x, 0.0, 0.0], "velocity": [v, 0.0, 0.0]}
            for x, v in [(-0.01, 0.3), (0.0, -0.5), (0.01, 0.1)]
        ]
        # The fastest two, head-on.
        assert case_of(COLLISION, {"spheres": spheres}).speed_bound_m_s == pytest.approx(0.8)

    def test_a_light_sphere_is_thrown_by_a_heavy_one(self):
        """Head-on with 0.4 m/s, a mass ratio of 8: it leaves with 16/9 of that."""
        spheres = [
            {"radius": r, "position": [x, 0.0, 0.0], "velocity": [v, 0.0, 0.0]}
            for r, x, v in [(2e-3, -0.01, 0.3), (1e-3, 0.01, -0.1)]
        ]
        case = case_of(COLLISION, {"spheres": spheres})
        assert case.speed_bound_m_s == pytest.approx(0.4 * 16 / 9, rel=1e-12)

    def test_spheres_that_overlap_at_the_start_part_with_what_their_spring_held(self):
        overlap, radius = 1e-5, 1e-3
        spheres = [
            {"radius": radius, "position": [x, 0.0, 0.0]} for x in (0.0, 2 * radius - overlap)
        ]
        case = case_of(COLLISION, {"spheres": spheres})
        modulus = MATERIAL["youngs_modulus"] / (1 - MATERIAL["poissons_ratio"] ** 2) / 2
        energy = 8 / 15 * modulus * math.sqrt(radius / 2) * overlap**2.5
        mass = MATERIAL["density"] * 4 / 3 * math.pi * radius**3
        assert case.speed_bound_m_s == pytest.approx(math.sqrt(2 * energy / (mass / 2)), rel=1e-9)

    def test_free_fall_over_the_diagonal(self):
        case = case_of(COLLISION, {"gravity": {"acceleration": [0.0, 0.0, -2.0]}})
        diagonal = math.sqrt(0.04**2 + 2 * 0.01**2)
        expected = 2 * math.sqrt(2 * 2.0 * diagonal) + 0.01
        assert case.speed_bound_m_s == pytest.approx(expected, rel=1e-12)

    @pytest.mark.parametrize(("periods", "times"), [(0.2, 1), (1.0, 3), (10.0, 21)])
    def test_a_gradient_that_goes_to_and_fro_pushes_again(self, periods, times):
        """Thrown back by walls in time with it, spheres were seen to reach 1.3 times one fall."""
        speeds = [
            case_of(COLLISION, {"pressure": {"gradient": 1e4, "period": period}}).speed_bound_m_s
            for period in (None, 0.1 / periods)
        ]
        # The initial speeds, 5 mm/s each, are in both.
        one, again = (speed / 2.0 - 0.005 for speed in speeds)
        assert again == pytest.approx(math.sqrt(times) * one, rel=1e-12)

    def test_in_a_fluid_it_drives_no_faster_than_a_constant_one(self):
        changes = {"fluid": FLUID, "pressure": {"gradient": 10.0}}
        steady = case_of(COLLISION, changes)
        moving = case_of(COLLISION, {**changes, "pressure.period": 0.01})
        assert moving.speed_bound_m_s == steady.speed_bound_m_s

    def test_free_flight_in_a_fluid(self):
        case = case_of(SETTLING, {"box.high": [10.0, 0.01, 0.01], "time.step": GONE})
        force = 2 * math.pi * 0.0015**3 * 10.0
        expected = 2 * free_flight_speed_m_s(2000.0, 1e-3, 0.0015, force)
        assert case.speed_bound_m_s == pytest.approx(expected, rel=1e-12)

    @pytest.mark.parametrize("mass", [0.1, 10.0])
    def test_a_free_piston(self, mass):
        case = case_of(INFILTRATION, {"piston.mass": mass, "pressure": GONE, "fluid": GONE})
        assert case.speed_bound_m_s >= 2 * min(2.143e-3 * 1.0, math.sqrt(2 * 2.143e-3 * 0.03))

    @pytest.mark.parametrize(
        "fluid",
        [
            {"velocity_outside": "constant", "velocity": 0.2},
            {"velocity_outside": "constant", "velocity": -0.2},
            {"velocity_outside": "accelerating", "acceleration": 0.2},
            pytest.param({"velocity_outside": "accelerating", "acceleration": -0.2}),
        ],
        ids=str,
    )
    def test_a_fluid_in_motion(self, fluid):
        case = case_of(COLLISION, {"fluid": {**FLUID, **fluid}, "time.duration": 1.0})
        assert case.speed_bound_m_s >= 2 * 0.2

    def test_a_fluid_in_motion_inside_the_specimen(self):
        still, pore = (
            case_of(INFILTRATION, {"fluid.velocity_inside": inside}) for inside in ("still", "pore")
        )
        assert pore.speed_bound_m_s > still.speed_bound_m_s

    def test_where_nothing_moves_there_is_still_a_bound(self):
        spheres = [{"radius": 1e-3, "position": [0.0, 0.0, 0.0]}]
        assert case_of(COLLISION, {"spheres": spheres}).speed_bound_m_s > 0


@pytest.mark.parametrize(
    ("changes", "name", "way_out"),
    [
        ({"time.step": 1e-3}, "contact particle-particle", "time.step_fraction"),
        ({"time.step": 4.9e-3, "spheres": [COLLISION["spheres"][0]], "fluid": FLUID,
          "drag": {"scheme": "exact"}, "contact.restitution": GONE,
          "particles.density": 7e-3}, "drag", "shorten"),
    ],
)  # fmt: skip
def test_a_step_above_a_bound_is_refused_with_the_way_out(changes, name, way_out):
    changes = {key: value for key, value in changes.items() if key != "contact.restitution"}
    with pytest.raises(SceneError) as caught:
        case_of(COLLISION, changes)
    text = str(caught.value)
    assert f"time.step = {changes['time.step']:g} s" in text
    assert name in text
    assert way_out in text
    # What the message allows is accepted, what is a little more is not.
    allowed = float(text.split("must be at most ")[1].split()[0])
    case_of(COLLISION, {**changes, "time.step": 0.999 * allowed})
    with pytest.raises(SceneError, match="at most"):
        case_of(COLLISION, {**changes, "time.step": 1.001 * allowed})


def test_the_papers_step_is_accepted():
    assert make_case(make_scene(shipped("infiltration"))).time.step_s == 1.0e-4


PLANS = st.fixed_dictionaries(
    {
        "time.duration": st.floats(1e-3, 100.0),
        "time.step": st.just(GONE),
        "output.samples": st.integers(10, 2000),
        "output.frames": st.integers(1, 300),
        "output.images": st.integers(0, 10),
        "drag.scheme": st.sampled_from(["auto", "implicit", "held", "exact"]),
    },
    optional={"drag.refresh": st.floats(1e-5, 10.0), "drag.tolerance": st.floats(1e-4, 0.1)},
)


def time_of(changes) -> TimePlan:
    """The plan of a scene; none, where held forces would be kept for too long, and only there."""
    try:
        return case_of(SETTLING, changes).time
    except SceneError as refusal:
        text = str(refusal)
        assert changes["drag.scheme"] == "held"
        assert text.startswith("drag.refresh = ")
        longest = float(text.split("must be at most ")[1].split()[0])
        samples = changes["time.duration"] / changes["output.samples"]
        # The message rounds to four digits.
        assert min(samples, changes.get("drag.refresh", math.inf)) > 0.999 * longest
        reject()


def is_a_plan(time):
    assert time.step_s <= time.bound_s * (1 + 1e-9)
    # refresh | sample | frame, image and steps.
    for interval in (time.sample_every, time.frame_every, time.image_every, time.steps):
        assert interval % time.refresh_every == 0
    for interval in (time.frame_every, time.image_every, time.steps):
        assert interval % time.sample_every == 0
    assert time.frame_every <= time.steps
    assert min(time.refresh_every, time.frame_every, time.image_every) >= 1
    if time.drag_scheme == "held":
        # A held force is followed over its interval, and kept for no longer than is stable.
        (drag,) = [bound for bound in time.bounds if bound.name == "drag"]
        assert time.refresh_every * time.step_s <= 2.5 * drag.step_s * (1 + 1e-9)
        assert time.drag_resolved


@given(PLANS)
@settings(deadline=None)
def test_a_chosen_step_gives_a_plan_that_ends_in_time(changes):
    time = time_of(changes)
    is_a_plan(time)
    # The chosen step divides the duration: only the rounding of the division is left.
    assert time.steps * time.step_s == pytest.approx(changes["time.duration"], rel=1e-12)
    assert time.steps == time.sample_every * changes["output.samples"]
    if "drag.refresh" in changes and time.keeps_drag:
        assert time.refresh_every * time.step_s <= changes["drag.refresh"] * (1 + 1e-9) or (
            time.refresh_every == 1
        )


@given(PLANS, st.floats(1e-3, 1.0))
@settings(deadline=None)
def test_a_given_step_is_kept(changes, part):
    chosen = time_of(changes)
    step = part * chosen.bound_s
    assume(chosen.steps / part < 1e12)
    time = case_of(SETTLING, {**changes, "time.step": step}).time
    is_a_plan(time)
    assert time.step_s == step
    # The interval between samples gives way, and the duration by half of one at most.
    assert abs(time.steps * step - changes["time.duration"]) <= 0.51 * time.sample_every * step


@given(PLANS)
@settings(deadline=None)
def test_the_last_frame_is_that_of_the_last_step(changes):
    time = time_of(changes)
    steps = frame_steps(time)
    assert steps[-1] == time.steps
    assert len(set(steps)) == len(steps)


def test_a_run_as_long_as_the_engine_cannot_count_is_refused():
    with pytest.raises(SceneError, match=r"time\."):
        case_of(COLLISION, {"time.duration": 1e9})


@pytest.mark.parametrize("scheme", ["held", "implicit"])
def test_what_is_kept_is_kept_as_long_as_the_tolerance_allows(scheme):
    changes = {"drag.scheme": scheme, "time.duration": 100.0, "output.samples": 10}
    times = [
        case_of(SETTLING, {**changes, "time.step": GONE, "drag.tolerance": t}).time
        for t in (0.0004, 0.0016)
    ]
    intervals = [time.refresh_every * time.step_s for time in times]
    slip = free_flight_speed_m_s(2000.0, 1e-3, 0.0015, 2 * math.pi * 0.0015**3 * 10.0)
    mass = 7000.0 * 4 / 3 * math.pi * 0.0015**3
    relaxation = mass / float(drag_coefficient_n_s_m(2000.0, 1e-3, 0.0015, slip))
    for interval, tolerance in zip(intervals, (0.0004, 0.0016), strict=True):
        longest = math.sqrt(2 * tolerance) / 1.354 * relaxation
        # Refreshes divide the interval of the samples, of which there are at least 80 here.
        assert longest * (1 - 1 / 80) <= interval <= longest * (1 + 1e-12)


@pytest.mark.parametrize(("scheme", "kept"), [("implicit", True), ("held", False)])
def test_stokes_drag_needs_no_refreshing(scheme, kept):
    """Below Re = 1 K is constant, renewed with the samples only; a force is not."""
    time = case_of(
        SETTLING, {"fluid.viscosity": 1.0, "drag.scheme": scheme, "time.step": GONE}
    ).time
    assert (time.refresh_every == time.sample_every) == kept


def test_what_particles_relax_within_is_not_resolved():
    """Beyond a quarter of m / K; only the implicit scheme may keep anything for so long."""
    changes = {"drag.scheme": "implicit", "time.duration": 100.0, "output.samples": 10}
    relaxation = bound(case_of(SETTLING, {"drag.scheme": "exact"}), "drag").step_s / 0.1
    for refresh, resolved in [(0.2, True), (0.249, True), (0.28, False), (1.0, False)]:
        time = case_of(SETTLING, {**changes, "drag.refresh": refresh * relaxation}).time
        # Whole steps: the interval is a little shorter than asked for.
        assert 0.9 * refresh * relaxation < time.refresh_every * time.step_s
        assert time.drag_resolved == resolved


@pytest.mark.parametrize(
    ("changes", "scheme", "keeps"),
    [
        ({"drag.scheme": "exact"}, "exact", False),
        ({"drag.scheme": "held"}, "held", True),
        ({"drag.scheme": "implicit"}, "implicit", True),
        ({"fluid": GONE}, "", False),
    ],
)
def test_the_plan_names_its_scheme(changes, scheme, keeps):
    time = case_of(SETTLING, {**changes, "time.step": GONE}).time
    assert time.drag_scheme == scheme
    assert time.keeps_drag == keeps


def test_without_particles_nothing_but_the_samples_bounds_the_step():
    case = case_of(COLLISION, {"spheres": [GRAIN], "grains": GRAINS})
    assert [bound.name for bound in case.time.bounds] == ["duration"]


def test_a_lone_particle_without_walls_meets_nobody():
    case = case_of(COLLISION, {"spheres": COLLISION["spheres"][:1]})
    assert [bound.name for bound in case.time.bounds] == ["duration"]


class TestPressedContacts:
    """A bed's contacts may be stiffer than those of its collisions."""

    def test_in_a_thick_fluid_they_count(self):
        """Spheres pushed at a wall: the speed that they reach in flight is next to none."""
        spheres = [{"radius": 0.0015, "position": [x, 0.0, 0.0]} for x in (-0.01, 0.01)]
        changes = {
            "spheres": spheres, "pressure": {"gradient": 1e4}, "box.walls": ["x+"],
            "fluid": {"density": 1000.0, "viscosity": 1e4},
        }  # fmt: skip
        bounds = [b.name for b in case_of(COLLISION, changes).time.bounds if b.name != "duration"]
        assert bounds[0] == "pressed particle-particle"

    def test_the_force_is_what_drives_over_the_spheres_of_a_layer(self):
        case = case_of(INFILTRATION, {"piston.mass": 0.5, "pressure": GONE, "fluid": GONE})
        force = pressing_force_n(case.scene, case.layout, case.population)
        low, high = np.array(case.layout.low), np.array(case.layout.high)
        radius = case.population.particle_radii_m.mean()
        layer = min(case.population.particles, np.prod((high - low)[1:]) / (2 * radius) ** 2)
        assert force == pytest.approx(4.0 * 0.5 * 2.143e-3 / layer, rel=1e-12)

    def test_what_nothing_presses_has_no_bound(self):
        assert not [
            bound for bound in case_of(COLLISION, {}).time.bounds if "pressed" in bound.name
        ]


class TestPeriodBound:
    """A gradient that goes to and fro is resolved, where nothing else asks for short steps."""

    SOFT: ClassVar = {
        "particles.youngs_modulus": 1.0, "contact.largest_overlap": 1.0, "output.samples": 10,
    }  # fmt: skip

    def test_a_hundredth_of_it_bounds_the_step(self):
        pressure = {"pressure": {"gradient": 1.0, "period": 0.05}}
        case = case_of(COLLISION, {**self.SOFT, **pressure})
        assert bound(case, "period").step_s == pytest.approx(5e-4, rel=1e-12)
        assert case.time.bounds[0].name == "period"
        assert case.time.step_s <= 5e-4

    def test_a_step_that_was_given_is_refused(self):
        pressure = {"pressure": {"gradient": 1.0, "period": 0.05}, "time.step": 6e-4}
        with pytest.raises(SceneError, match=r"at most 0\.0005 s, set by period"):
            case_of(COLLISION, {**self.SOFT, **pressure})

    @pytest.mark.parametrize("pressure", [{"gradient": 1.0}, {"gradient": 0.0, "period": 0.05}])
    def test_without_one_there_is_none(self, pressure):
        case = case_of(COLLISION, {"pressure": pressure})
        assert "period" not in {each.name for each in case.time.bounds}


class TestPistonBound:
    """Soft bodies have long contacts: what the piston's servo asks for then counts."""

    SOFT: ClassVar[dict[str, object]] = {
        "contact.stiffness_scale": 1e-4, "time.step_fraction": 1.0, "fluid": GONE, "pressure": GONE,
        "piston.acceleration": 10.0, "output.samples": 10,
    }  # fmt: skip

    def test_the_piston_shortens_a_step_that_nobody_gave(self):
        case = case_of(INFILTRATION, self.SOFT)
        assert case.time.bounds[0].name == "piston"
        radius = case.population.particle_radii_m.mean()
        assert case.time.bound_s <= radius / (4.0 * case.speed_bound_m_s)
        # The servo has its room: the engine's rule, with what the piston can reach twice over.
        limit = speed_limit_m_s(case)
        assert 2.0 * case.speed_bound_m_s <= limit < case.skin_m / (2.0 * case.time.step_s)

    def test_a_step_that_was_given_is_refused(self):
        allowed = case_of(INFILTRATION, self.SOFT).time.bound_s
        with pytest.raises(SceneError, match="set by piston"):
            case_of(INFILTRATION, {**self.SOFT, "time.step": 1.01 * allowed})
        assert case_of(INFILTRATION, {**self.SOFT, "time.step": allowed}).time.step_s == allowed


def test_a_small_particle_counts_among_large_ones():
    spheres = [
        {"radius": r, "position": [x, 0.0, 0.0], "velocity": [0.01, 0.0, 0.0]}
        for r, x in [(0.004, -0.01), (0.001, 0.0), (0.003, 0.01)]
    ]
    case = case_of(COLLISION, {"spheres": spheres})
    mass = MATERIAL["density"] * 4 / 3 * np.pi * 0.001**3
    small = Body(0.001, float(mass), 1.0e7, 0.25)
    expected = 0.1 * contact_duration_s(small, small, case.speed_bound_m_s)
    assert case.time.bound_s <= expected * (1 + 1e-12)
