"""Packings taken together, exponents, and the words that numbers choose."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from paper_results import answer, measured, only, point

from liggghts_driver.paper.catalogue import GRADIENT, MAIN
from liggghts_driver.paper.changes import change_between, change_words
from liggghts_driver.paper.pooled import (
    Pooled,
    exponent,
    flow,
    flow_from,
    flows_by_gradient,
    local_exponents,
    missing,
    pool,
    velocity_range,
)
from liggghts_driver.paper.stored import NOT_RUN
from liggghts_driver.paper.words import any_of, cell, counted, holds, judge, listed, short_cell
from liggghts_driver.statistics import students_half_width
from liggghts_driver.studies.paired import Change

#: Rounding of a few operations.
EXACT = 1e-12


def pooled(*values: float, own: float | None = 0.1) -> Pooled:
    found = pool({n: measured(value, own) for n, value in enumerate(values)})
    assert found is not None
    return found


class TestPooling:
    def test_by_hand(self):
        """Means 1, 2, 3: s = 1, t of two degrees 4.3027; errors in time stay apart."""
        found = pool({n: measured(n, 0.3 + 0.1 * n) for n in (1, 2, 3)})
        assert found.mean == pytest.approx(2.0, rel=EXACT)
        assert found.between == pytest.approx(4.302652729911275 / math.sqrt(3), rel=1e-9)
        assert found.in_time == pytest.approx(math.sqrt((0.16 + 0.25 + 0.36) / 3), rel=EXACT)
        assert found.half_width == found.between
        assert (found.packings, found.steady) == (3, 3)

    def test_one_packing_has_no_spread_and_is_judged_by_its_time(self):
        found = pooled(2.0)
        assert found.between is None
        assert found.half_width == found.in_time == 0.1

    def test_an_unknown_error_of_one_leaves_that_of_all_unknown(self):
        found = pool({0: measured(1.0, 0.1), 1: measured(1.0, None)})
        assert found.in_time is None

    def test_without_a_mean_there_is_nothing(self):
        assert pool({}) is None
        assert pool({0: measured(None)}) is None

    def test_invalid_runs_do_not_enter_and_unsteady_ones_do(self):
        verdicts = {"valid": 1e-6, "not_steady": 3e-6, "invalid": 9e-6}
        points = [point({}, n, answer(q, verdict=v)) for n, (v, q) in enumerate(verdicts.items())]
        points.append(point({}, 3))
        found = flow(points, "entrance")
        assert found.mean == pytest.approx(2e-6, rel=EXACT)
        assert (found.packings, found.steady) == (2, 1)

    def test_a_flow_from_an_instant_on_is_the_slope_to_the_end(self):
        """Volumes are whole mm3: over 39.5 s at 2000 mm3/s that is 1e-5 of the rate."""
        found = flow_from([point({}, 0, answer(2e-6))], "entrance", 10.0)
        assert found.mean == pytest.approx(2e-6, rel=2e-5)
        assert found.steady == 1

    def test_what_still_comes_up_is_told(self):
        """It flows at the entrance: it may come to the middle yet."""
        found = answer(1e-6)
        on_its_way = replace(found, reached_s={"entrance": 21.0, "middle": None})
        several = [point({}, 0, found), point({}, 1, on_its_way)]
        assert flow(several, "entrance").rising == 0
        assert flow(several, "middle").rising == 1

    def test_packings_that_are_alike_by_chance_are_judged_by_their_time(self):
        found = pooled(1.0, 1.0, own=0.1)
        assert found.between == 0.0
        assert found.interval == pytest.approx(0.1 / math.sqrt(2.0), rel=EXACT)
        assert pooled(1.0, 3.0, own=0.1).interval == pooled(1.0, 3.0).between

    def test_why_there_is_no_number(self):
        invalid = point({}, 0, answer(1e-6, verdict="invalid"))
        failed = replace(point({}), state="failed", why="a made-up failure")
        assert missing([]) == NOT_RUN
        assert missing([point({}), invalid]) == NOT_RUN
        assert missing([failed, invalid]) == "no valid run"
        assert missing([invalid, point({}, 1, answer(0.0))]) == "nothing flows"

    def test_the_range_is_that_of_all_packings(self):
        several = [point({}, n, answer(1e-6, velocity_m_s=v)) for n, v in enumerate((1e-3, 2e-3))]
        assert velocity_range(several) == pytest.approx((0.9e-3, 2.2e-3))
        assert velocity_range([point({})]) is None


class TestExponents:
    def flows(self, *packings: float, gradients=(1.0, 2.0, 5.0, 10.0)):
        """Packing n goes with its own power of the gradient."""
        return {
            g: Pooled(1.0, None, None, {n: 3.0 * g**p for n, p in enumerate(packings)}, 0)
            for g in gradients
        }

    def test_a_power_law_gives_its_power(self):
        found = exponent(self.flows(0.74, 0.76))
        assert found.values[0] == pytest.approx(0.74, rel=1e-9)
        assert found.mean == pytest.approx(0.75, rel=1e-9)
        # s = 0.01 sqrt(2), over the root of two packings, t of one degree is 12.706.
        assert found.between == pytest.approx(12.7062 * 0.01, rel=1e-4)

    def test_errors_in_time_enter_by_the_slope_of_least_squares(self):
        """Of two gradients the root of both squared shares, over the logarithm of their ratio."""
        flows = {
            g: Pooled(g, 0.0, share * g, {0: g, 1: g}, 2) for g, share in ((1, 0.03), (2, 0.04))
        }
        found = exponent(flows)
        assert found.in_time == pytest.approx(0.05 / math.log(2.0), rel=1e-9)
        assert found.interval == pytest.approx(found.in_time / math.sqrt(2.0), rel=1e-9)

    def test_an_unknown_error_in_time_leaves_that_of_the_power_unknown(self):
        assert exponent(self.flows(0.74, 0.76)).in_time is None

    def test_only_gradients_that_are_asked_for_enter(self):
        flows = self.flows(1.0)
        flows[10.0] = Pooled(1.0, None, None, {0: 1e9}, 0)
        assert exponent(flows, lambda g: g < 10.0).mean == pytest.approx(1.0, rel=1e-9)

    def test_a_gradient_that_lacks_a_packing_does_not_enter(self):
        """It would else take this packing from all the others."""
        flows = self.flows(1.0, 0.5)
        flows[10.0] = Pooled(1.0, None, None, {0: 1e9}, 0)
        assert exponent(flows).values == pytest.approx({0: 1.0, 1: 0.5}, rel=1e-9)

    def test_of_two_gradients_the_packings_enter_that_both_have(self):
        flows = self.flows(1.0, 0.5, gradients=(5.0,)) | self.flows(1.0, gradients=(10.0,))
        assert exponent(flows).values == pytest.approx({0: 1.0}, rel=1e-9)

    def test_a_gradient_at_which_nothing_flows_does_not_enter(self):
        flows = self.flows(1.0)
        flows[1.0] = Pooled(0.0, None, None, {0: 0.0}, 0)
        assert exponent(flows).mean == pytest.approx(1.0, rel=1e-9)
        assert (1.0, 2.0) not in local_exponents(flows)

    def test_a_flow_that_still_comes_up_has_no_power(self):
        flows = self.flows(1.0)
        flows[1.0] = replace(flows[1.0], values={0: 1e-9}, rising=1)
        assert exponent(flows).mean == pytest.approx(1.0, rel=1e-9)
        assert (1.0, 2.0) not in local_exponents(flows)

    def test_one_gradient_has_no_exponent(self):
        assert exponent(self.flows(1.0, gradients=(1.0,))) is None

    def test_local_exponents_are_between_neighbours(self):
        flows = self.flows(1.0)
        flows[20.0] = Pooled(1.0, None, None, {0: 30.0}, 0)
        found = local_exponents(flows)
        assert list(found) == [(1.0, 2.0), (2.0, 5.0), (5.0, 10.0), (10.0, 20.0)]
        assert found[10.0, 20.0].mean == pytest.approx(0.0, abs=1e-9)

    def test_flows_are_found_by_gradient_the_smallest_first(self):
        points = [point({GRADIENT: g}, 0, answer(1e-6 * g)) for g in (10.0, 1.0, 20.0)]
        found = flows_by_gradient(only("gradient", points), MAIN, "entrance")
        assert list(found) == [1.0, 10.0, 20.0]
        assert np.array([p.mean for p in found.values()]) == pytest.approx([1e-6, 1e-5, 2e-5])


class TestJudgements:
    def test_within_the_interval_it_agrees(self):
        found = judge(pooled(1.9, 2.0, 2.1), 1.9)
        assert found.agrees
        assert found.words == "agrees with 1.90 within its interval"

    def test_outside_it_differs_by_so_much(self):
        found = judge(pooled(1.49, 1.5, 1.51), 2.0)
        assert found.kind == "differs"
        assert found.words == "is 25 % below 2.00"
        assert judge(pooled(2.49, 2.5, 2.51), 2.0).words == "is 25 % above 2.00"

    def test_an_interval_that_agrees_with_too_much_decides_nothing(self):
        found = judge(pooled(1.0, 3.0), 2.0)
        assert found.kind == "undecided"
        assert not found.agrees

    def test_one_packing_decides_nothing(self):
        assert judge(pooled(2.0), 2.0).kind == "one packing"
        found = judge(pooled(1.0, own=None), 2.0)
        assert found.words == "is 50 % below 2.00 in one packing, which decides nothing"

    def test_what_the_settings_explain_is_not_decided(self):
        """4 % off with hardly any spread; the settings may be off by 5 %."""
        assert judge(pooled(1.9199, 1.9201), 2.0).kind == "undecided"
        assert judge(pooled(1.7999, 1.8001), 2.0).kind == "differs"

    def test_a_flow_that_still_comes_up_decides_nothing(self):
        found = judge(replace(pooled(1.49, 1.5, 1.51), rising=1), 2.0)
        assert found.kind == "rising"
        assert found.words == "is 25 % below 2.00, but still comes up"

    def test_without_a_number_nothing_is_said(self):
        assert judge(None, 1.0).words == NOT_RUN

    def test_a_value_within_the_interval_is_held(self):
        assert holds(pooled(0.9, 1.0, 1.1), 1.2)
        assert not holds(pooled(0.9, 1.0, 1.1), 1.3)
        assert not holds(pooled(1.0), 1.0)

    def test_units_change_no_judgement(self):
        found = judge(pooled(1.9e-6, 2.0e-6, 2.1e-6, own=1e-8), 1.9e-6, 1e-6)
        assert found.words == "agrees with 1.90 within its interval"


class TestCells:
    def test_both_errors_stand_apart(self):
        assert cell(pooled(1.8, 2.0, 2.2, own=0.11)) == "2.00 ± 0.50 ± 0.11 (3)"

    def test_what_is_not_known_is_a_question_mark(self):
        assert cell(pooled(2.0, own=0.11)) == "2.00 ± ? ± 0.11 (1)"
        assert cell(pooled(2.0, own=None)) == "2.00 ± ? ± ? (1)"
        assert cell(None) == NOT_RUN

    def test_short(self):
        assert short_cell(pooled(1.8, 2.0, 2.2)) == "2.00 ± 0.50 (3)"
        assert short_cell(pooled(2.0, 2.0)) == "2.000 ± 0.071 (2)"  # alike by chance: that of time
        assert short_cell(pooled(2.0)) == "2.00 (one packing)"
        assert short_cell(None) == NOT_RUN

    def test_what_drifts_or_still_comes_up_is_marked(self):
        drifting = pool({0: measured(1.0, 0.1), 1: measured(1.0, 0.1, steady=False)})
        assert cell(drifting).endswith("(2) ~")
        assert short_cell(replace(drifting, rising=1)).endswith("(2) ~ →")
        assert short_cell(replace(pooled(2.0), steady=0)) == "2.00 (one packing) ~"

    @pytest.mark.parametrize(
        ("items", "text"), [([], ""), (["a"], "a"), (["a", "b"], "a and b"), ("abc", "a, b and c")]
    )
    def test_lists(self, items, text):
        assert listed(items) == text

    def test_one_reading_that_bears_a_claim_out_is_enough(self):
        assert any_of(["no", "yes", "not run yet"]) == "yes"
        assert any_of(["no", "in part"]) == "in part"
        assert any_of(["no", "no"]) == "no"
        assert any_of(["no", "not decided"]) == "not decided"
        assert any_of(["no", "not run yet"]) == "not decided"
        assert any_of(["not run yet"]) == "not run yet"

    def test_counts(self):
        assert counted(1, "run") == "1 run"
        assert counted(3, "run") == "3 runs"


class TestChanges:
    def test_no_narrower_than_errors_in_time_allow(self):
        """Doubled in both packings; shares of 3 and 4 % in time, over the root of two packings."""
        own, base = pooled(2.0, 4.0, own=0.12), pooled(1.0, 2.0, own=0.045)
        change = change_between(own, base)
        assert change.mean == pytest.approx(1.0, rel=EXACT)
        shares = math.hypot(0.12 / 3.0, 0.045 / 1.5)
        assert change.ci95 == pytest.approx(2.0 * shares / math.sqrt(2.0), rel=EXACT)

    def test_packings_that_differ_by_more_are_what_counts(self):
        change = change_between(pooled(2.0, 2.5, own=1e-6), pooled(1.0, 1.0, own=1e-6))
        assert change.ci95 == pytest.approx(students_half_width([1.0, 1.5]), rel=EXACT)
        assert change_between(pooled(2.0), pooled(1.0)).ci95 is None
        assert change_between(pooled(2.0, 2.5, own=None), pooled(1.0, 1.0)).ci95 == change.ci95

    @pytest.mark.parametrize(
        ("mean", "ci95", "words"),
        [
            (0.123, 0.05, "+12.3 ± 5.0 %"),
            (-0.123, 0.05, "\u221212.3 ± 5.0 %"),
            (-0.004, 0.12, "0 ± 12 %"),
            (0.5, None, "+50 %, one packing"),
        ],
    )
    def test_in_per_cent_with_a_sign(self, mean, ci95, words):
        assert change_words(Change(mean, ci95, 1 if ci95 is None else 3)) == words
