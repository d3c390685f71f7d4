from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from liggghts_driver.sweeps.pooling import free_axes, main_effect, pool, state_of

GRADIENT, COLUMN = "pressure.gradient", "pressure_gradient_pa_m"
FLOW, CI95 = "flow_rate_entrance_m3_s", "flow_rate_entrance_ci95_m3_s"
WITHIN = "flow_rate_entrance_variance_within_m6_s2"
BETWEEN = "flow_rate_entrance_variance_between_m6_s2"
Z95 = stats.norm.ppf(0.975)
#: Sums of a few doubles: what is left is rounding.
EXACT = 1e-12


def points(values, ci95=None, verdicts=None, states=None, **columns):
    """Points with a flow rate; its estimate is 2 m3/s."""
    number = len(values)
    return pd.DataFrame(
        {
            "run": [f"{n:x}" for n in range(number)],
            "state": pd.array(states or ["done"] * number, dtype="string"),
            "verdict": pd.array(verdicts or ["valid"] * number, dtype="string"),
            COLUMN: 1.0,
            FLOW: np.asarray(values, dtype=float),
            CI95: np.full(number, np.nan) if ci95 is None else np.asarray(ci95, dtype=float),
            "flowing_velocity_m_s": np.nan,
            "flowing_velocity_ci95_m_s": np.nan,
            "estimate_flow_rate_m3_s": 2.0,
            "estimate_flowing_velocity_m_s": 1.0,
            "max_overlap_over_radius": np.linspace(0.0, 0.01, number),
            "wall_s": 10.0,
            "core_s": 20.0,
            **columns,
        }
    )


def only(table, axes=(GRADIENT,)):
    pooled = pool(table, axes)
    assert len(pooled) == 1
    return pooled.iloc[0]


def test_variances_and_interval_by_hand():
    """Means 1, 2, 3 (s² = 1); standard errors 0.3, 0.4, 0.5: W = (0.09 + 0.16 + 0.25)/3 = 1/6."""
    row = only(points([1.0, 2.0, 3.0], Z95 * np.array([0.3, 0.4, 0.5])))
    assert row[FLOW] == pytest.approx(2.0, rel=EXACT)
    assert row[WITHIN] == pytest.approx(1 / 6, rel=EXACT)
    assert row[BETWEEN] == pytest.approx(5 / 6, rel=EXACT)
    assert row[CI95] == pytest.approx(4.302652729911275 / math.sqrt(3), rel=1e-9)  # t, 2 degrees
    assert row["flow_rate_entrance_interval_from"] == "replicates"
    assert row["flow_rate_entrance_replicates"] == 3
    assert row["ratio_entrance"] == pytest.approx(1.0, rel=EXACT)
    assert row["ratio_entrance_ci95"] == pytest.approx(row[CI95] / 2.0, rel=EXACT)
    assert (row["max_overlap_over_radius"], row["wall_mean_s"], row["core_sum_s"]) == (0.01, 10, 60)


def test_replicates_that_agree_by_chance_leave_the_errors_of_the_runs():
    """All 2, standard errors 0.3: nothing between, and an interval of t·0.3/√3, not of zero."""
    row = only(points([2.0, 2.0, 2.0], [Z95 * 0.3] * 3))
    assert row[BETWEEN] == 0.0
    assert row[CI95] == pytest.approx(4.302652729911275 * 0.3 / math.sqrt(3), rel=1e-9)


def test_one_run_has_its_own_interval_and_no_variance_between():
    row = only(points([2.0], [0.5]))
    assert row[CI95] == pytest.approx(0.5, rel=EXACT)
    assert row["flow_rate_entrance_interval_from"] == "one_run"
    assert math.isnan(row[BETWEEN])
    assert row[WITHIN] == pytest.approx((0.5 / Z95) ** 2, rel=EXACT)


def test_without_the_runs_own_intervals_the_split_is_not_known_and_the_interval_is():
    row = only(points([1.0, 2.0, 3.0], [0.1, np.nan, 0.1]))
    assert math.isnan(row[WITHIN])
    assert math.isnan(row[BETWEEN])
    assert row[CI95] == pytest.approx(4.302652729911275 / math.sqrt(3), rel=1e-9)
    alone = only(points([1.0]))
    assert math.isnan(alone[CI95])
    assert alone["flow_rate_entrance_interval_from"] == "none"


def test_valid_and_not_steady_are_never_mixed_and_invalid_never_enters():
    verdicts = ["valid", "not_steady", "invalid", "valid"]
    row = only(points([1.0, 100.0, 1000.0, 3.0], [0.1] * 4, verdicts))
    assert (row["mean_of"], row[FLOW]) == ("valid", 2.0)
    counts = ["replicates", "done", "valid", "not_steady", "invalid", "failed", "unfinished"]
    assert row[counts].tolist() == [4, 4, 2, 1, 1, 0, 0]
    row = only(points([1.0, 3.0, 1000.0], [0.1] * 3, ["not_steady", "not_steady", "invalid"]))
    assert (row["mean_of"], row[FLOW]) == ("not_steady", 2.0)
    row = only(points([1000.0], [0.1], ["invalid"]))
    assert row["mean_of"] == "none"
    assert math.isnan(row[FLOW])


def test_what_did_not_end_is_counted_and_enters_nothing():
    states = ["done", "failed", "running", "waiting", "interrupted"]
    verdicts = ["valid", None, None, None, None]
    row = only(points([1.0] + [np.nan] * 4, [0.1] + [np.nan] * 4, verdicts, states))
    counts = ["replicates", "done", "valid", "failed", "unfinished"]
    assert row[counts].tolist() == [5, 1, 1, 1, 3]
    assert row[FLOW] == 1.0
    assert row["flow_rate_entrance_replicates"] == 1


def test_a_result_that_a_run_does_not_have_counts_for_itself():
    row = only(points([1.0, 2.0], [0.1, 0.1], flowing_velocity_m_s=[np.nan, 5.0]))
    assert row["flow_rate_entrance_replicates"] == 2
    assert row["flowing_velocity_replicates"] == 1
    assert row["flowing_velocity_m_s"] == 5.0


def test_points_that_share_a_run_are_one_replicate():
    """Points that differ in their ranks alone are one scene and one run."""
    row = only(points([1.0, 1.0], [0.1, 0.1], run=["a", "a"]))
    assert row["replicates"] == 1
    assert row["flow_rate_entrance_interval_from"] == "one_run"


def test_combinations_keep_their_order_and_their_points():
    table = points([5.0, 1.0, 7.0, 3.0], **{COLUMN: [30.0, 10.0, 30.0, 10.0]})
    pooled = pool(table, [GRADIENT])
    assert pooled[COLUMN].tolist() == [30.0, 10.0]
    assert pooled[FLOW].tolist() == [6.0, 2.0]


def test_without_axes_there_is_one_combination():
    assert only(points([1.0, 3.0]), axes=())[FLOW] == 2.0


def test_a_table_without_a_single_result_pools_to_counts():
    table = points([np.nan] * 2, verdicts=[None] * 2, states=["failed"] * 2, core_s=np.nan)
    row = only(table)
    assert (row["failed"], row["mean_of"], row["core_sum_s"]) == (2, "none", 0.0)
    assert math.isnan(row[FLOW])
    assert row["flow_rate_entrance_replicates"] == 0


def test_known_variances_are_found_again_and_the_interval_holds_the_truth():
    """4000 combinations of 5 runs: between 3², within 1², each drawn as the model says.

    The mean of the 4000 estimates of s² has a standard error of 10·√(2/4)/√4000 = 0.11; between
    is cut at 0 in 2 of 100 draws, which adds less than 0.01. Coverage has a standard error of
    √(0.95·0.05/4000) = 0.0034. Tolerances are 4 of these.
    """
    groups, runs, between, within, truth = 4000, 5, 3.0, 1.0, 7.0
    draw = np.random.default_rng(20240501)
    packing = draw.normal(truth, between, groups * runs)
    values = draw.normal(packing, within)
    place = np.repeat(np.arange(groups), runs).astype(float)
    pooled = pool(points(values, [Z95 * within] * values.size, **{COLUMN: place}), [GRADIENT])
    assert pooled[WITHIN].to_numpy() == pytest.approx(1.0, rel=EXACT)
    assert pooled[BETWEEN].mean() == pytest.approx(between**2, abs=0.46)
    holds = (pooled[FLOW] - truth).abs() <= pooled[CI95]
    assert holds.mean() == pytest.approx(0.95, abs=0.0136)


def test_the_interval_is_wide_enough_where_nothing_is_between():
    """Then (within + between)/n is too large rather than too small: at least 95 % hold."""
    draw = np.random.default_rng(7)
    groups, runs = 4000, 3
    place = np.repeat(np.arange(groups), runs).astype(float)
    values = draw.normal(0.0, 1.0, groups * runs)
    pooled = pool(points(values, [Z95] * values.size, **{COLUMN: place}), [GRADIENT])
    holds = pooled[FLOW].abs() <= pooled[CI95]
    assert holds.mean() > 0.95


def grid(**columns):
    return pd.DataFrame({"mean_of": "valid", "failed": 0, "invalid": 0, "unfinished": 0, **columns})


def test_an_axis_that_follows_another_or_has_one_value_is_not_free():
    axes = (GRADIENT, "time.duration", "specimen.phi", "specimen.exit")
    pooled = grid(
        pressure_gradient_pa_m=[1.0, 2.0, 4.0],
        time_duration_s=[9.0, 5.0, 2.0],
        specimen_phi=[0.5, 0.1, 0.9],
        specimen_exit=["open"] * 3,
    )
    assert free_axes(pooled, axes) == (GRADIENT, "specimen.phi")
    assert free_axes(pooled, ()) == ()


def test_a_word_that_goes_with_each_value_follows_it():
    pooled = grid(specimen_exit=["open", "closed"], pressure_gradient_pa_m=[1.0, 2.0])
    assert free_axes(pooled, ("specimen.exit", GRADIENT)) == ("specimen.exit",)


def test_the_main_effect_is_over_combinations_known_everywhere():
    """y = 3 was not found at x = 2, so it enters at no x."""
    pooled = grid(x=[1, 1, 1, 2, 2, 2], y=[1, 2, 3, 1, 2, 3], r=[1.0, 3.0, 50.0, 5.0, 7.0, np.nan])
    effect = main_effect(pooled, "r", "x", ["y"])
    assert effect.to_dict() == {1: 2.0, 2: 6.0}
    assert main_effect(pooled.iloc[[0, 4]], "r", "x", ["y"]).empty


def test_what_lacks_is_told_apart():
    pooled = grid(
        r=[1.0, 1.0, np.nan, np.nan, np.nan, np.nan],
        mean_of=["valid", "not_steady", "none", "none", "none", "valid"],
        failed=[1, 0, 1, 0, 0, 0],
        invalid=[0, 0, 1, 1, 0, 0],
        unfinished=[0, 0, 1, 1, 1, 0],
    )
    told = ["valid", "not_steady", "failed", "invalid", "unfinished", "nothing"]
    assert state_of(pooled, "r").tolist() == told
