"""The flow rate of one run in a window of time, computed anew from its stored curve."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from paper_results import INTERVAL_S, SAMPLES, answer

from liggghts_driver.paper.windows import (
    WINDOW_S,
    comes_up,
    rate_from,
    rates_in_windows,
    second_half,
    steady_since,
    uneven,
)
from liggghts_driver.statistics import flow_rate

#: Rounding of a few operations.
EXACT = 1e-12


def curved(volume_mm3, from_s=0.0, mean=1e-6):
    """A run with a volume past the entrance as a function of time [s], whose window began then."""
    found = answer(1e-6)
    own = replace(found.flow_m3_s["entrance"], from_s=from_s, mean=mean)
    volume = [round(volume_mm3(INTERVAL_S * n)) for n in range(SAMPLES)]
    curves = replace(found.curves, volume_mm3={"entrance": volume})
    return replace(found, flow_m3_s={"entrance": own}, curves=curves)


def from_25_s(time_s):
    """Nothing up to 25 s, 2000 mm3/s from then on."""
    return max(0.0, 2000.0 * (time_s - 25.0))


def with_a_standstill(time_s):
    """8000 mm3/s up to 15 s, nothing up to 25 s, then 2000 mm3/s."""
    return 8000.0 * min(time_s, 15.0) + from_25_s(time_s)


class TestTheSecondHalf:
    def test_a_standstill_is_not_steady_there_either(self):
        """Four tenths of it at twice and more of the mean rate: a random walk may do so, too."""
        half = second_half(curved(lambda t: 8000.0 * max(0.0, min(t, 45.0) - 40.0)), "entrance")
        assert not half.steady

    def test_error_and_steadiness_are_those_of_a_window_that_is_nearly_the_same(self):
        """The rate is not: a slope of 2.1e-6 m3/s from 21 s on, 2e-6 passes in the half itself."""
        found = answer(2e-6)
        own = replace(found.flow_m3_s["entrance"], mean=2.1e-6, from_s=21.0)
        half = second_half(replace(found, flow_m3_s={"entrance": own}), "entrance")
        assert half.mean == pytest.approx(2e-6, rel=2e-5)  # volumes are whole mm3
        assert (half.ci95, half.steady, half.from_s) == (own.ci95, True, 25.0)

    @pytest.mark.parametrize("mean", [1e-6, 0.0, None])
    def test_any_other_window_becomes_the_second_half(self, mean):
        """Over the whole it would be 1000 mm3/s; the last sample is at 49.5 s, the middle 25 s."""
        half = second_half(curved(from_25_s, mean=mean), "entrance")
        assert half.mean == pytest.approx(2e-6, rel=EXACT)
        assert half.from_s == pytest.approx(25.0)
        assert half.ci95 == pytest.approx(0.0, abs=1e-9)
        assert half.steady

    def test_its_steadiness_is_that_of_the_second_half(self):
        """The own window said that it is steady; the rate falls to zero."""
        half = second_half(curved(lambda t: -40.0 * (50.0 - t) ** 2), "entrance")
        assert not half.steady
        assert half.reason.startswith("drifts: changes by")

    def test_mean_and_interval_are_of_one_window(self):
        found = rate_from(curved(with_a_standstill), "entrance", 30.0)
        assert (found.mean, found.from_s) == (pytest.approx(2e-6, rel=EXACT), 30.0)


class TestSteadyFromAnInstantOn:
    def test_a_straight_curve_is(self):
        assert steady_since(answer(2e-6), "entrance", 10.0)

    def test_what_arrives_later_is_not(self):
        assert not steady_since(answer(2e-6), "middle", 10.0)  # after 12 s
        assert steady_since(answer(2e-6), "middle", 13.0)

    def test_a_standstill_that_no_drift_is_told_from_is_not_steady_either(self):
        """As in our runs: a fast entry, nothing from 12.5 to 18 s, a burst, and 1700 mm3/s."""

        def volume_mm3(time_s):
            burst = 6000.0 * min(max(0.0, time_s - 18.0), 2.0)
            return 4000.0 * min(time_s, 12.5) + burst + 1700.0 * max(0.0, time_s - 20.0)

        found = curved(volume_mm3)
        times_s, volumes = INTERVAL_S * np.arange(20, SAMPLES), found.curves.volume_mm3["entrance"]
        assert flow_rate(times_s, np.array(volumes[20:]), whole=True).steady
        assert not steady_since(found, "entrance", 10.0)
        assert "below half or above twice" in rate_from(found, "entrance", 10.0).reason

    def test_a_standstill_is_not_steady(self):
        assert not steady_since(curved(with_a_standstill), "entrance", 10.0)
        assert steady_since(curved(with_a_standstill), "entrance", 26.0)


class TestShortWindows:
    def test_rates(self):
        """Volumes are whole mm3: over 2.5 s at 2000 mm3/s that is 2e-4 of the rate."""
        found = rates_in_windows([answer(2e-6)], "entrance", 10.0)
        assert list(found)[:3] == [10.0, 12.5, 15.0]
        assert list(found.values()) == pytest.approx([2e-6] * 15, rel=2e-4)

    def test_the_slowest_and_the_fastest_in_the_order_of_time(self):
        assert uneven(rates_in_windows([curved(with_a_standstill)], "entrance", 10.0)) == (10, 15)
        assert uneven({0.0: 1e-6, 2.5: 2e-7, 5.0: 1e-6}) == (0.0, 2.5)

    def test_a_burst_is_as_uneven_as_a_standstill(self):
        """No window below half of 1.5e-6, one above twice that."""
        calm = {2.5 * n: 1e-6 for n in range(5)}
        assert uneven({**calm, 12.5: 4e-6}) == (0.0, 12.5)

    def test_what_stays_within_a_factor_of_two_is_even(self):
        assert uneven({0.0: 1.0e-6, 2.5: 1.5e-6, 5.0: 0.8e-6}) is None

    def test_so_few_particles_are_uneven_by_chance(self):
        """8 and 40 particles, 22 on average: 8, 88 and 40 are more than chance."""
        particle_m3_s = 14.1e-9 / WINDOW_S
        assert uneven({0.0: 8 * particle_m3_s, 2.5: 40 * particle_m3_s}) is None
        assert uneven({0.0: 8 * particle_m3_s, 2.5: 88 * particle_m3_s}) is not None
        assert uneven({0.0: 0.0}) is uneven({}) is None


class TestComingUp:
    @pytest.mark.parametrize(("growth", "expected"), [(1.2, False), (1.4, True), (0.5, False)])
    def test_from_the_third_quarter_to_the_last(self, growth, expected):
        """1000 mm3/s up to 37.5 s, then so many times as much."""
        found = curved(lambda t: 1000.0 * (t + (growth - 1.0) * max(0.0, t - 37.5)))
        assert comes_up(found, "entrance") == expected

    def test_a_few_particles_more_are_chance(self):
        """Twice as many in the last quarter: 8 and 16 particles, or 80 and 160."""
        assert not comes_up(curved(lambda t: 9.0 * (t + max(0.0, t - 37.5))), "entrance")
        assert comes_up(curved(lambda t: 90.0 * (t + max(0.0, t - 37.5))), "entrance")

    def test_a_front_that_is_still_on_its_way_does(self):
        """Where the entrance is reached and flows; a blocked entrance lets nothing come."""
        way = {"entrance": 1.0, "middle": None}
        assert comes_up(replace(answer(1e-6, 0.0), reached_s=way), "middle")
        assert not comes_up(replace(answer(0.0), reached_s=way), "middle")
        assert not comes_up(replace(answer(0.0), reached_s={"entrance": None}), "entrance")
