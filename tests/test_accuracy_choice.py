"""Which settings of a study are taken, and which problem a study is of."""

from __future__ import annotations

import pytest
from accuracy_studies import QUANTITIES, REFERENCE, SOFT, STEP, row, study_of
from hypothesis import given
from hypothesis import strategies as st
from small_scenes import COLLISION, INFILTRATION, scene_of

from liggghts_driver.accuracy import FINEST, Study, choose, makes_a_problem, problem_sha256
from liggghts_driver.scene.accuracy import NUMERICAL
from liggghts_driver.studies import knobs

SCENE = scene_of(INFILTRATION)


def chosen(tolerance: float, *rows):
    return choose(Study.model_validate(study_of(SCENE, *rows)), tolerance)


class TestChoice:
    @pytest.mark.parametrize(
        ("tolerance", "title"),
        [
            (0.079, "step_fraction 0.2"),
            (0.081, "step_fraction 0.2, stiffness_scale 0.1"),
            # The mean error of 1.1 % is within, its interval is not.
            (0.03, "reference"),
            (1e-6, "reference"),
        ],
    )
    def test_the_cheapest_whose_intervals_are_within(self, tolerance, title):
        assert chosen(tolerance).title == title

    def test_what_is_known_of_it(self):
        choice = chosen(0.05)
        assert choice.settings == {**FINEST, "time.step_fraction": 0.2}
        assert (choice.error, choice.reach) == (0.011, pytest.approx(0.031))
        assert (choice.cost_over_reference, choice.replicates) == (0.3, 8)
        assert (choice.overlap, choice.finest) == (0.005, False)

    def test_the_reference_has_no_error(self):
        # Whatever its row says, and however many packings there were.
        choice = chosen(0.01, row("reference", {}, 1.0, 0.0, None, replicates=1), STEP)
        assert (choice.error, choice.reach, choice.finest) == (0.0, 0.0, True)
        assert choice.settings == FINEST

    @pytest.mark.parametrize("knob", ["section", "window", "something new"])
    def test_what_is_no_setting_is_never_taken(self, knob):
        small = row(knob, {"time.step_fraction": 0.4}, 0.01, 0.0, 0.0)
        assert chosen(0.5, REFERENCE, small).finest

    def test_a_smaller_section_is_not_taken_either_when_turned_with_others(self):
        changes = {"time.step_fraction": 0.4, "specimen.width": 0.01}
        assert chosen(0.5, REFERENCE, row("together", changes, 0.01, 0.0, 0.0)).finest

    @pytest.mark.parametrize(("mean", "ci95"), [(0.0, None), (None, 0.0), (None, None)])
    def test_what_has_no_interval_is_not_taken(self, mean, ci95):
        single = row("step", {"time.step_fraction": 0.4}, 0.01, mean, ci95, replicates=1)
        assert chosen(0.5, REFERENCE, single).finest

    @pytest.mark.parametrize("quantity", QUANTITIES)
    def test_every_quantity_counts(self, quantity):
        wrong = {**STEP, "errors": {**STEP["errors"], quantity: SOFT["errors"][quantity]}}
        assert chosen(0.05, REFERENCE, wrong).finest
        unknown = {**STEP, "errors": {n: e for n, e in STEP["errors"].items() if n != quantity}}
        assert chosen(0.05, REFERENCE, unknown).finest

    def test_a_quantity_that_nothing_is_chosen_by_does_not(self):
        other = {**STEP["errors"], "flowing_velocity": {"mean": 1.0, "ci95": 1.0, "replicates": 8}}
        assert not chosen(0.05, REFERENCE, {**STEP, "errors": other}).finest

    def test_the_fewest_packings_count(self):
        few = {**STEP["errors"], QUANTITIES[0]: {"mean": 0.0, "ci95": 0.0, "replicates": 3}}
        assert chosen(0.05, REFERENCE, {**STEP, "errors": few}).replicates == 3

    def test_what_costs_more_than_the_reference_is_not_taken(self):
        dear = row("drag", {"drag.scheme": "implicit"}, 1.2, 0.0, 0.0)
        assert chosen(0.05, REFERENCE, dear).finest

    def test_without_a_reference_there_may_be_nothing(self):
        assert chosen(0.05, SOFT) is None
        assert chosen(0.1, SOFT).title == SOFT["title"]

    errors = st.tuples(st.floats(0.01, 2.0), st.floats(-0.5, 0.5), st.none() | st.floats(0.0, 0.5))

    @given(st.lists(errors, max_size=8), st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)))
    def test_it_is_within_and_a_looser_tolerance_costs_no_more(self, rows, tolerances):
        made = [row("step", {"time.step_fraction": 0.2}, *each) for each in rows]
        strict, loose = (chosen(tolerance, REFERENCE, *made) for tolerance in sorted(tolerances))
        assert strict.reach <= min(tolerances)
        assert loose.reach <= max(tolerances)
        assert loose.cost_over_reference <= strict.cost_over_reference <= 1.0


class TestOverlap:
    def test_a_softer_contact_may_overlap_half_as_much_again_as_it_did(self):
        settings = chosen(0.1).settings_for(0.01)
        assert settings["contact.largest_overlap"] == 0.072  # 1.5 x 4.8 %
        assert {**settings, **FINEST, **SOFT["changes"]} == settings

    @pytest.mark.parametrize("allowed", [0.072, 0.1])
    def test_a_limit_that_is_not_reached_stays(self, allowed):
        assert "contact.largest_overlap" not in chosen(0.1).settings_for(allowed)


class TestProblem:
    @pytest.mark.parametrize(
        "changes",
        [
            {"title": "another"},
            {"seed": 7},
            {"output": {"samples": 30, "images": 2}},
            {"output.paraview": True},
            {"accuracy": "reference"},
            {"time.duration": 3.0, "time.step": 1e-5},
            {"time.step_fraction": 0.3},
            {"drag.scheme": "exact"},
            {"drag.refresh": 1e-3, "drag.tolerance": 0.1, "drag.carrier": "addforce"},
            {"contact.stiffness_scale": 0.1},
            {"contact.largest_overlap": 0.5},
            {"particles.density": 7000},
        ],
        ids=str,
    )
    def test_the_same(self, changes):
        assert problem_sha256(scene_of(INFILTRATION, changes)) == problem_sha256(SCENE)
        for name in changes:
            assert name == "particles.density" or not makes_a_problem(name)

    @pytest.mark.parametrize(
        "changes",
        [
            {"pressure.gradient": 5.0},
            {"particles.count": 41},
            {"specimen.width": 0.021},
            {"contact.friction": 0.1},
            {"contact.damping_ratio": 0.2},
            {"effects.screen": 0.01},
            {"gravity": {}},
        ],
        ids=str,
    )
    def test_another(self, changes):
        assert problem_sha256(scene_of(INFILTRATION, changes)) != problem_sha256(SCENE)
        assert all(makes_a_problem(name) for name in changes)

    def test_without_drag_it_is_another(self):
        without = scene_of(INFILTRATION, {"drag.scheme": "none"})
        assert problem_sha256(without) != problem_sha256(SCENE)

    def test_all_that_is_left_out_is_in_the_scene(self):
        """So that a key with a new name is not taken for a part of the problem."""
        tables = scene_of(COLLISION).model_dump(mode="json")
        for name in NUMERICAL:
            table, key = name.split(".")
            assert key in tables[table]

    def test_the_finest_settings_are_those_of_the_study(self):
        assert dict(knobs.FINEST) == dict(FINEST)
