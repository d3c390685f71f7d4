"""A pressure gradient that goes to and fro in time: decks, plan, mistakes, law, energy."""

from __future__ import annotations

import hashlib
import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from decks import commands, deck_of, evaluate, taken_up, undefined_names, variables, whole
from hypothesis import given, settings
from hypothesis import strategies as st
from small_scenes import COLLISION, FLUID, GONE, INFILTRATION, case_of, scene_of

from liggghts_driver.drag_plan import LONGEST_KEPT, plan_drag
from liggghts_driver.effects import EFFECTS
from liggghts_driver.errors import SceneError
from liggghts_driver.flowing import flowing_threshold_m_s
from liggghts_driver.identity import scene_hash
from liggghts_driver.physics.oscillation import pushes, swing
from liggghts_driver.population import populate
from liggghts_driver.prediction import NoDarcyError, predict, steady_estimate
from liggghts_driver.results.energy import energy_budget
from liggghts_driver.scene.canonical import canonical_json
from liggghts_driver.scene.layout import layout
from liggghts_driver.studies.energy import Ran, kinetic_j, work_j

PERIOD, GRADIENT = 0.7, 10.0
TO_AND_FRO = {"pressure.period": PERIOD}
#: Changes of the infiltration scene by which each scheme, or none, is taken.
SCHEMES = {
    "exact": {"drag.scheme": "exact"},
    "held": {"drag.scheme": "held"},
    "addforce": {"drag.carrier": "addforce"},
    "implicit": {"drag.scheme": "implicit"},
    "none": {"drag.scheme": "none"},
    "no fluid": {"fluid": GONE, "piston.mass": 1.0},
}
HELD = ("held", "addforce")


class TestOscillation:
    @pytest.mark.parametrize(("times", "number"), [(0.24, 1), (0.26, 2), (0.74, 2), (1.0, 3)])
    def test_stretches_without_a_change_of_sign(self, times, number):
        assert pushes(times * PERIOD, PERIOD) == number
        assert pushes(times * PERIOD, None) == 1

    @given(st.floats(0.01, 20.0))
    def test_as_many_as_the_signs_that_follow_one_another(self, periods):
        signs = np.sign(swing(np.linspace(0.0, periods, 20001), 1.0))
        counted = 1 + np.count_nonzero(np.diff(signs[signs != 0]))
        # A last stretch shorter than a step of the line may be missed.
        assert pushes(periods, 1.0) - counted in (0, 1)
        assert pushes(periods - 0.002, 1.0) <= counted

    @given(st.integers(0, 2**32 - 1), st.floats(0.1, 5.0), st.sampled_from([0.0, 0.5, 0.98]))
    @settings(deadline=None)
    def test_no_way_between_two_ends_gives_more_than_one_push_each(self, seed, periods, keeps):
        """However something is thrown about in a channel of length 1 by what else there is."""
        rng = np.random.default_rng(seed)
        times = np.linspace(0.0, periods, 4001)
        force = swing((times[1:] + times[:-1]) / 2.0, 1.0)
        # With the force, as something that a wall throws back now and then at no cost.
        wish = np.where(rng.random(len(force)) < keeps, force > 0, rng.random(len(force)) < 0.5)
        place = np.concatenate([[rng.random()], wish])
        assert float(force @ np.diff(place)) <= pushes(periods, 1.0) + 1e-9

    def test_what_has_no_period_is_constant(self):
        assert swing([0.0, 0.3, 1e9], None).tolist() == [1.0, 1.0, 1.0]
        assert swing(np.array([0.0, 0.25, 0.5]) * PERIOD, PERIOD) == pytest.approx([1, 0, -1])


class TestDeck:
    @pytest.mark.parametrize("scheme", SCHEMES)
    @given(step=st.integers(0, 10**9), radius=st.floats(0.0012, 0.0018))
    @settings(max_examples=20, deadline=None)
    def test_the_force_at_each_step_is_that_of_its_instant(self, scheme, step, radius):
        case = case_of(INFILTRATION, {**SCHEMES[scheme], **TO_AND_FRO})
        known = variables(deck_of(case).files["deck.in"])
        here = {"x": 0.01, "vx": 0.0, "r": radius, "step": step}
        if scheme in HELD:
            # Without the drag that it is kept with; a refresh acts half a step late.
            here["f_pressure"] = evaluate(known["pressure"], known, here)
            here |= {"f_coefficient": 0.0} | {f"f_slip[{n}]": 0.0 for n in (1, 2, 3)}
            force = evaluate(known["kept_x"], known, here)
            step += 0.5 * (case.time.refresh_every + 1)
            outside = evaluate(known["kept_x"], known, here | {"x": -0.01})
            assert outside == 0.0
        else:
            force = evaluate(known["pressure"], known, here)
        largest = 2.0 * math.pi * radius**3 * GRADIENT  # Eq. 20
        phase = 2.0 * math.pi * step * case.time.step_s / PERIOD
        # Rounding of a phase of so many radians.
        assert force == pytest.approx(largest * math.cos(phase), abs=largest * 1e-15 * (9 + phase))

    @pytest.mark.parametrize("scheme", SCHEMES)
    def test_it_is_added_once_inside_the_specimen(self, scheme):
        case = case_of(INFILTRATION, {**SCHEMES[scheme], **TO_AND_FRO})
        added = [w[4:] for w in commands(deck_of(case).files["deck.in"]) if "addforce" in w]
        pressure = [words for words in added if "v_pressure" in words]
        if scheme in HELD:
            assert not pressure
        else:
            assert pressure == [["v_pressure", "0.0", "0.0", "region", "specimen"]]
        if scheme == "implicit":
            # What the implicit scheme keeps of it is nothing: the property stays at its zeros.
            assert "property/atom dragforce" not in whole(deck_of(case))

    @pytest.mark.parametrize("tables", [COLLISION, INFILTRATION], ids=["box", "specimen"])
    @pytest.mark.parametrize("scheme", ["exact", "held", "addforce", "implicit"])
    def test_nothing_is_used_that_is_not_defined(self, tables, scheme):
        changes = {"fluid": FLUID, "pressure.gradient": GRADIENT, **TO_AND_FRO}
        case = case_of(tables, {**changes, **SCHEMES[scheme]})
        for deck in (deck_of(case), deck_of(taken_up(case))):
            assert not list(undefined_names(whole(deck)))
        # From a checkpoint it goes on with the same formula of the engine's own step.
        formulas = [variables(deck_of(c).files["deck.in"]) for c in (case, taken_up(case))]
        assert formulas[0]["swing"] == formulas[1]["swing"]

    @pytest.mark.parametrize("scheme", SCHEMES)
    def test_no_gradient_does_not_swing(self, scheme):
        changes = {"pressure.gradient": 0.0, **TO_AND_FRO, **SCHEMES[scheme]}
        assert "swing" not in whole(deck_of(case_of(INFILTRATION, changes)))

    def test_reason_and_cost(self):
        (pressure,) = (effect for effect in EFFECTS if effect.name == "pressure")
        case = case_of(INFILTRATION, TO_AND_FRO)
        assert "10 Pa/m to and fro in 0.7 s, inside" in pressure.decide(case.scene)[1]
        for scheme, changes in SCHEMES.items():
            cost = pressure.cost(case_of(INFILTRATION, {**changes, **TO_AND_FRO}))
            assert (cost == 0.0) == (scheme in HELD)


class TestPlan:
    """Particles that relax in thousands of seconds: only the period makes an interval short."""

    @staticmethod
    def plan(changes, slip=1e-2, **pressure):
        heavy = {"particles.density": 7e9, "fluid": FLUID, "time.duration": 1e6}
        table = {"gradient": GRADIENT, "period": PERIOD} | pressure
        scene = scene_of(COLLISION, {**heavy, "pressure": table, **changes})
        found = plan_drag(scene, populate(scene, layout(scene)), slip, 1e-9)
        assert found is not None
        return found

    @pytest.mark.parametrize("tolerance", [1e-3, 5e-3, 3e-2])
    @pytest.mark.parametrize("scheme", ["held", "implicit"])
    def test_the_period_bounds_the_interval(self, scheme, tolerance):
        changes = {"drag.scheme": scheme, "drag.tolerance": tolerance}
        expected = math.sqrt(2.0 * tolerance) * PERIOD / (2.0 * math.pi)
        assert self.plan(changes).interval_s == pytest.approx(expected, rel=1e-12)
        other = self.plan(changes, period=2.0 * PERIOD).interval_s
        assert other == pytest.approx(2.0 * expected, rel=1e-12)
        for constant in ({"period": None}, {"gradient": 0.0}):
            assert self.plan(changes, **constant).interval_s > 100.0 * expected

    @pytest.mark.parametrize("tolerance", [1e-3, 5e-3, 3e-2])
    def test_costs_the_tolerance_at_the_most(self, tolerance):
        """A velocity cos(w t), extrapolated, and a gradient at the middle, for all phases."""
        kept = math.sqrt(2.0 * tolerance)  # over 1 / w
        phase = np.linspace(0.0, 2.0 * math.pi, 721)
        ahead = np.cos(phase) + 0.5 * (np.cos(phase) - np.cos(phase - kept))
        slip = np.abs(ahead - np.cos(phase + 0.5 * kept)).max()
        middle = 1.0 - math.sin(0.5 * kept) / (0.5 * kept)
        assert slip + middle <= tolerance
        # Not by far: 3/8 and 1/24 of the square, of which the bound takes a half; the next term is
        # of third order.
        assert slip + middle == pytest.approx((3 / 8 + 1 / 24) * kept**2, abs=kept**3 / 2)

    def test_where_the_implicit_scheme_keeps_nothing_the_period_is_nothing_to_it(self):
        assert self.plan({"drag.scheme": "implicit"}, slip=1e-5).interval_s > 100.0 * PERIOD

    @pytest.mark.parametrize("scheme", ["held", "implicit", "auto"])
    def test_too_long_a_refresh_is_refused(self, scheme):
        longest = LONGEST_KEPT * PERIOD / (2.0 * math.pi)
        changes = {"drag.scheme": scheme, "drag.refresh": 0.999 * longest}
        assert self.plan(changes).interval_s == 0.999 * longest
        with pytest.raises(SceneError, match=r"drag\.refresh = .* must be at most 0\.02785 s"):
            self.plan({**changes, "drag.refresh": 1.001 * longest})
        exact = {"drag.scheme": "exact", "drag.refresh": 1.001 * longest}
        assert self.plan(exact).scheme == "exact"

    def test_in_a_case(self):
        """The interval is bounded in steps, and so is the piece of the run."""
        slow, quick = (
            case_of(INFILTRATION, {"pressure.period": period, "drag.scheme": "held"}).time
            for period in (1e3, 0.1)
        )
        assert quick.refresh_every * quick.step_s <= 0.1 * 0.1 / (2.0 * math.pi)
        assert slow.refresh_every > 2 * quick.refresh_every


class TestScene:
    def test_the_pore_velocity_is_that_of_a_constant_gradient(self):
        with pytest.raises(SceneError, match=r"fluid\.velocity_inside = 'pore': .*has a period"):
            scene_of(INFILTRATION, {**TO_AND_FRO, "fluid.velocity_inside": "pore"})

    @pytest.mark.parametrize("period", [0.0, -1.0, "long"])
    def test_a_period_is_a_time(self, period):
        with pytest.raises(SceneError, match=r"pressure\.period"):
            scene_of(INFILTRATION, {"pressure.period": period})

    def test_without_one_a_scene_is_known_by_the_same_hash(self):
        scene = scene_of(INFILTRATION)
        assert "period" not in scene.model_dump(mode="json", exclude_none=True)["pressure"]
        assert scene_hash(scene) != scene_hash(scene_of(INFILTRATION, TO_AND_FRO))
        data = scene.model_dump(mode="json", exclude={"title", "accuracy"})
        del data["pressure"]["period"]
        assert scene_hash(scene) == hashlib.sha256(canonical_json(data).encode()).hexdigest()


class TestLaw:
    def test_an_estimate_is_of_the_largest_gradient_and_says_so(self):
        steady, moving = (
            predict(scene_of(INFILTRATION)),
            predict(scene_of(INFILTRATION, TO_AND_FRO)),
        )
        assert moving.flow_rate_m3_s == steady.flow_rate_m3_s
        assert not moving.valid
        *others, last = moving.warnings
        assert tuple(others) == steady.warnings
        assert last.startswith("pressure.period = 0.7 s: ")
        assert "10 Pa/m" in last
        # Asked for at a gradient, it is the steady flow that was asked for.
        assert predict(scene_of(INFILTRATION, TO_AND_FRO), 10.0).warnings == steady.warnings

    def test_nothing_is_held_against_it(self):
        constant = scene_of(INFILTRATION)
        assert steady_estimate(constant).as_dict() == predict(constant).as_dict()
        with pytest.raises(NoDarcyError, match=r"pressure\.period = 0\.7 s: .* steady"):
            steady_estimate(scene_of(INFILTRATION, TO_AND_FRO))


class TestFlowing:
    def test_slow_swings_flow_as_a_constant_gradient_does(self):
        steady = flowing_threshold_m_s(scene_of(INFILTRATION))
        assert flowing_threshold_m_s(scene_of(INFILTRATION, {"pressure.period": 1e3})) == steady

    @pytest.mark.parametrize("gradient", [GRADIENT, -GRADIENT])
    def test_quick_ones_by_the_speed_that_inertia_leaves(self, gradient):
        changes = {"pressure": {"gradient": gradient, "period": 0.01}}
        acceleration = 1.5 * GRADIENT / 7000.0  # physics.md: the same for every radius
        expected = 0.1 * acceleration * 0.01 / (2.0 * math.pi)
        found = flowing_threshold_m_s(scene_of(INFILTRATION, changes))
        assert found == pytest.approx(expected, rel=1e-12)


class TestEnergy:
    @pytest.mark.parametrize(("periods", "times"), [(0.2, 1), (0.3, 2), (1.0, 3), (10.0, 21)])
    def test_the_budget_has_one_way_for_each_half_period(self, periods, times):
        case = case_of(INFILTRATION)
        still = energy_budget(case)
        period = case.scene.time.duration / periods
        moving = energy_budget(case_of(INFILTRATION, {"pressure.period": period}))
        assert still is not None
        assert moving is not None
        assert moving.items_j["pressure"] == pytest.approx(times * still.items_j["pressure"])
        others = {name: value for name, value in moving.items_j.items() if name != "pressure"}
        assert others == {n: v for n, v in still.items_j.items() if n != "pressure"}

    @pytest.mark.parametrize("frames", [50, 100, 200])
    def test_the_work_of_a_free_sphere_is_its_kinetic_energy(self, frames):
        """But for the midpoint rule's error from frame to frame, of second order."""
        gradient, rate = 1000.0, 2.0 * math.pi / PERIOD
        times = np.linspace(0.0, 2.1 * PERIOD, frames + 1)
        acceleration = 1.5 * gradient / 7000.0
        speed = acceleration / rate * np.sin(rate * times)
        way = acceleration / rate**2 * (1.0 - np.cos(rate * times))
        ran = a_run({"pressure": {"gradient": gradient, "period": PERIOD}}, times, way, speed)
        most = kinetic_j(ran).max()
        wrong = float(np.abs(work_j(ran) - kinetic_j(ran)).max() / most)
        # 1 %: the next term, of fourth order, with the fewest frames.
        assert wrong == pytest.approx((rate * times[1]) ** 2 / 8.0, rel=0.01)
        # As if the gradient were constant, it is not.
        constant = a_run({"pressure": {"gradient": gradient}}, times, way, speed)
        assert np.abs(work_j(constant) - kinetic_j(ran)).max() > most

    def test_in_a_specimen_the_way_before_it_is_no_work(self):
        alone = {"piston": GONE, "fluid.velocity_outside": "still"}
        case = case_of(INFILTRATION, {**TO_AND_FRO, **alone})
        count = case.population.particles
        x = np.linspace(-0.02, 0.005, 101)
        places = np.zeros((101, count, 3))
        places[:, :, 0] = x[:, None]
        times = np.linspace(0.0, PERIOD / 4.0, 101)
        ran = replace(a_run({}, times, 0.0 * x, 0.0 * x), case=case, positions_m=places)
        work = work_j(ran)
        assert not work[x <= 0.0].any()
        force = 1.5 * GRADIENT * float(case.population.particle_volumes_m3.sum())
        inside = times[x >= 0.0]
        # The mean of the cosine over the last fifth of a quarter of a period.
        share = np.cos(2.0 * math.pi * inside / PERIOD).mean()
        assert work[-1] == pytest.approx(force * 0.005 * share, rel=0.01)


def a_run(changes, times, way, speed) -> Ran:
    """A made-up run of two spheres side by side."""
    case = case_of(COLLISION, changes)
    places, velocities = np.zeros((2, len(times), 2, 3))
    places[:, :, 0], velocities[:, :, 0] = way[:, None], speed[:, None]
    series = pd.DataFrame({"time_s": times})
    return Ran(case, series, times, places, velocities, {})
