"""What speaks against an answer, beside the estimate, and as JSON."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from small_scenes import COLLISION, INFILTRATION, case_of

from liggghts_driver.effects.drag_law import reynolds_bound
from liggghts_driver.effects.piston import speed_limit_m_s
from liggghts_driver.results.comparison import compare
from liggghts_driver.results.energy import energy_budget
from liggghts_driver.results.plain import plain
from liggghts_driver.results.verdict import STEP_TOLERANCE, judge, piston_in_grains
from liggghts_driver.statistics import Rate, SeriesMean

STEADY = Rate(2e-6, 1e-7, True, 10.0, 50.0, "no drift", 100.0)
DRIFTING = replace(STEADY, steady=False, reason="drifts: changes by +30 %")
VELOCITY = SeriesMean(2.8e-3, 1e-4, 2.7e-3, 2.9e-3, True, 10.0, "no drift", 100.0, 0)


@pytest.fixture(scope="module")
def case():
    return case_of(INFILTRATION)


def series(case, **columns) -> pd.DataFrame:
    """A blameless series, changed."""
    time = np.linspace(0.0, 1.0, 21)
    blameless = {
        "step": np.arange(21),
        "time_s": time,
        "kinetic_energy_j": 0.0 * time,
        "largest_speed_m_s": 0.5 * case.speed_bound_m_s * time,
        "flowing_velocity_m_s": np.where(time > 0.5, 1e-3, np.nan),
        "largest_reynolds": 1.0 + time,
        "piston_x_m": -0.03 + 1e-3 * time,
    }
    return pd.DataFrame({**blameless, **columns})


def judged(case, rates, overlap=0.0, scale=1e-6, **columns):
    return judge(case, series(case, **columns), rates, overlap, scale)


def fault(case, overlap=0.0, **columns) -> str:
    verdict = judged(case, {"entrance": STEADY}, overlap, **columns)
    assert verdict.verdict == "invalid"
    (reason,) = verdict.reasons
    return reason


class TestJudge:
    def test_nothing_speaks_against_it(self, case):
        verdict = judged(case, {"entrance": STEADY, "middle": STEADY}, 0.001)
        assert (verdict.verdict, verdict.reasons) == ("valid", ())

    def test_not_steady(self, case):
        verdict = judged(case, {"entrance": STEADY, "middle": DRIFTING})
        assert verdict.verdict == "not_steady"
        assert verdict.reasons == ("middle: drifts: changes by +30 %",)

    @pytest.mark.parametrize(
        ("mean", "ci95", "scale", "verdict"),
        [
            (2e-6, 0.24 * 2e-6, 0.0, "valid"),
            (2e-6, 0.26 * 2e-6, 0.0, "not_steady"),
            (-2e-6, 0.24 * 2e-6, 0.0, "valid"),
            # A blocked section: known well beside what was to be expected, or not.
            (0.0, 0.24e-6, 1e-6, "valid"),
            (0.0, 0.26e-6, 1e-6, "not_steady"),
            (0.0, 1e-9, 0.0, "not_steady"),
            (2e-6, math.inf, 1e-6, "not_steady"),
        ],
    )
    def test_an_interval_too_wide_decides_nothing(self, case, mean, ci95, scale, verdict):
        rate = replace(STEADY, mean_m3_s=mean, ci95_m3_s=ci95)
        found = judged(case, {"entrance": rate}, scale=scale)
        assert found.verdict == verdict
        assert bool(found.reasons) == (verdict == "not_steady")

    def test_a_fault_weighs_more_than_a_drift(self, case):
        assert judged(case, {"middle": DRIFTING}, 0.5).verdict == "invalid"

    @pytest.mark.parametrize("value", [math.nan, math.inf])
    def test_numbers_that_are_none(self, case, value):
        broken = np.linspace(0, 1e-9, 21)
        broken[7] = value
        assert "kinetic_energy_j" in fault(case, kinetic_energy_j=broken)

    def test_overlap(self, case):
        assert "0.02 of the smaller radius; contact.largest_overlap allows 0.01" in fault(
            case, 0.02
        )
        allowed = case_of(INFILTRATION, {"contact.largest_overlap": 0.05})
        assert judged(allowed, {"entrance": STEADY}, 0.02).verdict == "valid"

    def test_an_overlap_that_is_no_number(self, case):
        assert judged(case, {"entrance": STEADY}, math.nan).verdict == "invalid"

    def test_too_fast_for_the_step(self, case):
        # Eq. 21 goes with v^(-1/5): the step is too long when the speed has outrun its room.
        room = (STEP_TOLERANCE * case.time.bound_s / case.time.step_s) ** 5
        fast, slow = (case.speed_bound_m_s * room * factor for factor in (1.01, 0.99))
        reason = fault(case, largest_speed_m_s=np.full(21, fast))
        assert f"{fast:.3g} m/s" in reason
        assert f"it was {case.time.step_s:.3g} s" in reason
        good = judged(case, {"entrance": STEADY}, largest_speed_m_s=np.full(21, slow))
        assert good.verdict == "valid"

    def test_reynolds_beyond_the_decks_law(self, case):
        bound = reynolds_bound(case)
        reason = fault(case, largest_reynolds=np.full(21, 1.01 * bound))
        assert f"the deck's drag law ends at {bound:g}" in reason

    def test_piston_at_its_limit(self, case):
        limit = speed_limit_m_s(case)
        jump = -0.03 + np.minimum(0.95 * limit * np.linspace(0.0, 1.0, 21), 0.01)  # no grain there
        assert "servo's limit" in fault(case, piston_x_m=jump)

    def test_the_piston_in_the_grains(self, case):
        """They are fixed and in no frame; the series tells where the piston was."""
        population = case.population
        first = population.particles
        fronts = population.centres_m[first:, 0] - population.radii_m[first:]
        # Of those that stand before the piston's rectangle, which is the channel's section.
        inside = (np.abs(population.centres_m[first:, 1:]) < 0.01).all(axis=1)
        grain = int(np.where(inside, fronts, np.inf).argmin())
        radius = population.radii_m[first + grain]
        limit = case.scene.contact.largest_overlap
        for share, depth in ((0.99, 0.99 * limit), (1.01, 1.01 * limit), (None, 2.5)):
            x = fronts[grain] + depth * radius
            found, number = piston_in_grains(case, x)
            assert found >= depth * (1 - 1e-12)
            if share is not None:
                assert number == first + grain + 1
                assert found == pytest.approx(depth, rel=1e-9)  # a difference of places
        stands = np.linspace(-0.03, fronts[grain] + 0.05 * radius, 21)
        assert f"the piston overlapped grain {first + grain + 1} by 0.05 of its radius" in fault(
            case, piston_x_m=stands
        )

    def test_no_piston_in_no_grains(self):
        assert piston_in_grains(case_of(COLLISION), 1.0) == (0.0, 0)

    def test_energy_from_nowhere(self):
        """Nothing drives these: an integration that is right keeps their energy within 5 %."""
        case = case_of(COLLISION)
        start = energy_budget(case).items_j["start"]
        time = np.linspace(0.0, 1.0, 21)
        columns = {"time_s": time, "largest_speed_m_s": 0.0 * time}
        for share, verdict in ((1.049, "valid"), (1.051, "invalid")):
            grown = pd.DataFrame({**columns, "kinetic_energy_j": share * start * np.sqrt(time)})
            assert judge(case, grown, {}, 0.0).verdict == verdict
        driven = case_of(COLLISION, {"gravity.acceleration": [0.0, 0.0, -1e-6]})
        assert judge(driven, grown, {}, 0.0).verdict == "valid"

    def test_all_faults_at_once(self, case):
        bad = {"largest_reynolds": np.full(21, 1e9), "piston_x_m": np.linspace(0, 1.0, 21)}
        assert len(judged(case, {}, 0.5, **bad).reasons) == 4  # the grains are in its way

    def test_a_scene_without_any_of_it(self):
        case = case_of(COLLISION)
        columns = ["step", "time_s", "kinetic_energy_j", "largest_speed_m_s"]
        assert judge(case, series(case)[columns], {}, 0.0, 0.0).verdict == "valid"


ESTIMATE = {
    "applies": True,
    "particle_flow_rate_m3_s": 1.86e-6,
    "pore_velocity_m_s": 2.75e-3,
    "valid": True,
    "warnings": ["none really"],
}


class TestCompare:
    def test_ratio_and_z_score(self):
        found = compare({"entrance": STEADY}, VELOCITY, ESTIMATE)
        assert found["estimate_valid"] is True
        assert found["estimate_warnings"] == ["none really"]
        entrance = found["entrance"]
        assert entrance["ratio"] == pytest.approx(2 / 1.86, rel=1e-12)
        # 1.95996: half the width of a 95 % interval of a Gaussian over its deviation.
        expected = (2e-6 - 1.86e-6) / (1e-7 / 1.959964)
        assert entrance["z_score"] == pytest.approx(expected, rel=1e-6)
        assert found["flowing_velocity"]["ratio"] == pytest.approx(2.8 / 2.75, rel=1e-12)

    def test_no_estimate_no_comparison(self):
        assert compare({"entrance": STEADY}, None, {"applies": False, "reason": "no fluid"}) == {}

    def test_nothing_is_divided_by_zero(self):
        nothing = {**ESTIMATE, "particle_flow_rate_m3_s": 0.0}
        pair = compare({"entrance": replace(STEADY, ci95_m3_s=0.0)}, None, nothing)["entrance"]
        assert pair["ratio"] is None
        assert pair["z_score"] is None

    def test_an_interval_that_is_not_known_gives_no_score(self):
        unknown = replace(STEADY, ci95_m3_s=math.inf)
        assert compare({"entrance": unknown}, None, ESTIMATE)["entrance"]["z_score"] is None


class TestPlain:
    def test_numbers_of_numpy(self):
        data = plain({"a": np.float64(0.5), "b": np.int64(3), "c": np.bool_(True), 1: (1, [2.0])})
        assert json.loads(json.dumps(data, allow_nan=False)) == {
            "a": 0.5,
            "b": 3,
            "c": True,
            "1": [1, [2.0]],
        }
        assert type(data["b"]) is int
        assert type(data["c"]) is bool

    @pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, np.float64("nan")])
    def test_what_is_not_finite_is_null(self, value):
        assert plain({"a": [value, 1.0]}) == {"a": [None, 1.0]}

    def test_arrays_become_lists(self):
        assert plain({"a": np.array([1.0, math.nan])}) == {"a": [1.0, None]}
