"""From a whole run to its answer: every number that was promised, and all of it JSON."""

from __future__ import annotations

import json
import math

import pytest
from small_scenes import COLLISION, FLUID, INFILTRATION, case_of

from liggghts_driver.identity import scene_hash, templates_hash
from liggghts_driver.results.answer import analyse
from liggghts_driver.run import run_case
from liggghts_driver.rundir import RunDirectory


@pytest.fixture
def answer_of(binary, tmp_path, monkeypatch):
    """Run a scene by the stand-in, in which nothing moves, and analyse it."""
    monkeypatch.setenv("LIGGGHTS_DRIVER_BINARY", str(binary))

    def answer(tables, changes=None, behaviour=""):
        monkeypatch.setenv("FAKE_ENGINE", behaviour)
        case = case_of(tables, changes)
        return case, analyse(run_case(case, RunDirectory(tmp_path / "run")))

    return answer


def test_everything_promised_is_there(answer_of):
    case, answer = answer_of(INFILTRATION, {"output.samples": 50})
    results = json.loads(json.dumps(answer.results, allow_nan=False))
    assert {
        "verdict", "reasons", "counts", "sections", "flowing_velocity_m_s", "estimate",
        "comparison", "time_step_s", "time_step_bounds", "max_overlap_over_radius", "cost",
        "provenance",
    } <= set(results)  # fmt: skip
    assert results["counts"] == {
        "asked": 40,
        "placed": 40,
        "at_end": 40,
        "grains": case.population.grains,
    }
    assert set(results["sections"]) == {"entrance", "middle"}
    assert set(results["cost"]) >= {"wall_s", "cpu_s", "steps", "particle_steps_per_s", "parts"}
    assert results["cost"]["steps"] == case.time.steps
    provenance = results["provenance"]
    assert provenance["scene_sha256"] == scene_hash(case.scene)
    assert provenance["templates_sha256"] == templates_hash()
    assert provenance["engine"] == "LIGGGHTS-PUBLIC 3.8.0-fake"
    assert provenance["seed"] == 1
    assert provenance["command"][-1] == "both"


def test_where_nothing_moves_nothing_flows(answer_of):
    _, answer = answer_of(INFILTRATION, {"output.samples": 50})
    for section in answer.results["sections"].values():
        rate = section["particle_flow_rate_m3_s"]
        assert rate["mean"] == 0.0
        assert rate["ci95"] > 0.0  # up to three particles may have been due
    assert answer.results["flowing_velocity_m_s"]["mean"] is None
    # Forty particles in a second: the interval is wide beside what was expected.
    assert answer.verdict == "not_steady"
    assert answer.results["max_overlap_over_radius"] == 0.0


def test_a_series_too_short_is_not_steady(answer_of):
    _, answer = answer_of(INFILTRATION, {"output.samples": 10})
    assert answer.verdict == "not_steady"
    assert any("too short" in reason for reason in answer.results["reasons"])


def test_numbers_that_are_none_are_no_answer(answer_of):
    _, answer = answer_of(COLLISION, behaviour="nan")
    assert answer.verdict == "invalid"
    assert "not a number" in answer.results["reasons"][0]
    json.dumps(answer.results, allow_nan=False)


def test_a_collision_that_did_not_happen_claims_no_restitution(answer_of):
    _, answer = answer_of(COLLISION)
    assert "restitution" not in {check["name"] for check in answer.results["exact"]}
    # But of a pair its momentum is known, and that is asked.
    assert [check["name"] for check in answer.results["exact"]] == ["momentum_drift_over_scale"]


def test_a_lone_sphere_is_held_to_free_flight(answer_of):
    changes = {"spheres": COLLISION["spheres"][:1], "fluid": FLUID, "pressure.gradient": -10.0}
    _, answer = answer_of(COLLISION, changes)
    (check,) = answer.results["exact"]
    # physics.md: 2.77 mm/s, three digits; against the flow here.
    assert check["exact"] == pytest.approx(-2.77e-3, rel=0.002)
    assert check["simulated"] == 0.0
    assert check["ratio"] == 0.0
    assert answer.verdict == "valid"


def test_a_gradient_that_goes_to_and_fro_never_comes_to_a_balance(answer_of):
    pressure = {"gradient": -10.0, "period": 0.5}
    changes = {"spheres": COLLISION["spheres"][:1], "fluid": FLUID, "pressure": pressure}
    _, answer = answer_of(COLLISION, changes)
    assert answer.results["exact"] == []


def test_a_gradient_that_goes_to_and_fro_is_held_against_no_law(answer_of):
    _, answer = answer_of(INFILTRATION, {"pressure.period": 0.5, "output.samples": 50})
    assert answer.results["estimate"] == {
        "applies": False,
        "reason": "pressure.period = 0.5 s: Darcy's law is about a steady flow",
    }
    assert answer.results["comparison"] == {}


def test_the_series_has_time_and_units_and_starts_at_zero(answer_of):
    case, answer = answer_of(INFILTRATION)
    series = answer.series
    assert series["time_s"].iloc[0] == 0.0
    assert series["time_s"].iloc[-1] == pytest.approx(case.time.steps * case.time.step_s, rel=1e-12)
    assert len(series) == case.time.steps // case.time.sample_every + 1
    bare = {"step", "inside", "flowing", "largest_reynolds"}  # counts and pure numbers
    units = ("_s", "_m", "_m3", "_j", "_n", "_m_s")
    assert all(name.endswith(units) for name in set(series) - bare)
    assert math.isnan(series["flowing_velocity_m_s"].iloc[0])


def test_an_estimate_that_does_not_apply_says_why(answer_of):
    _, answer = answer_of(COLLISION)
    estimate = answer.results["estimate"]
    assert estimate["applies"] is False
    assert estimate["reason"]
    assert answer.results["comparison"] == {}


def test_the_reason_names_everything_that_is_missing(answer_of):
    _, answer = answer_of(COLLISION)
    assert "[specimen]" in answer.results["estimate"]["reason"]
