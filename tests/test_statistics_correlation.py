"""Errors of correlated series, against exact results for first-order autoregressive noise."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from liggghts_driver.statistics import fit_shape, mean_estimate

SEEDS = 400


def autoregressive(rng: np.random.Generator, n: int, phi: float) -> np.ndarray:
    """Stationary x[i] = phi x[i-1] + unit white noise; its tau is (1 + phi)/(1 - phi)."""
    before = rng.standard_normal() / np.sqrt(1.0 - phi**2)
    return lfilter([1.0], [1.0, -phi], rng.standard_normal(n), zi=[phi * before])[0]


def coverage(hits: list[bool]) -> float:
    return float(np.mean(hits))


@pytest.mark.parametrize("phi", [0.0, 0.5, 0.8, 0.9])
def test_autocorrelation_time_of_autoregressive_noise(phi: float) -> None:
    times = [
        mean_estimate(autoregressive(np.random.default_rng(seed), 2000, phi)).autocorrelation_time
        for seed in range(50)
    ]
    # Sokal's relative scatter of one estimate is sqrt(2 (2W + 1)/n) with a window W of a few tau:
    # 0.3 at tau = 19. The mean of 50 scatters by 0.04; Geyer's rule and the floor at 1 bias it up
    # by a few per cent.
    assert np.mean(times) == pytest.approx((1.0 + phi) / (1.0 - phi), rel=0.15)


@pytest.mark.parametrize("phi", [0.0, 0.5, 0.8, 0.9])
@pytest.mark.parametrize("n", [100, 500])
def test_interval_of_the_mean_holds_the_truth(phi: float, n: int) -> None:
    hits = []
    for seed in range(SEEDS):
        estimate = mean_estimate(5.0 + autoregressive(np.random.default_rng([seed, n]), n, phi))
        hits.append(abs(estimate.mean - 5.0) <= estimate.ci95)
    # 400 trials at 95 % scatter by sqrt(0.95 * 0.05/400) = 1.1 %; four of these, since the
    # intervals of series with few effective samples are themselves only good to a few per cent.
    assert 0.905 <= coverage(hits) <= 0.995


def test_interval_that_ignores_correlation_would_fail_the_same_test() -> None:
    hits = []
    for seed in range(SEEDS):
        series = autoregressive(np.random.default_rng([seed, 500]), 500, 0.8)
        hits.append(abs(series.mean()) <= 1.96 * series.std() / np.sqrt(500))
    assert coverage(hits) < 0.6  # the interval is sqrt(9) = 3 times too short: 49 %


def test_student_t_and_standard_error_of_white_noise() -> None:
    series = np.random.default_rng(3).standard_normal(400)
    estimate = mean_estimate(series)
    # Between the textbook's s/sqrt(n) and what a chance tau of at most 1.3 (n = 400) makes of it.
    textbook = series.std(ddof=1) / 20.0
    assert textbook * 0.999 <= estimate.standard_error <= 1.15 * textbook
    assert estimate.ci95 > 1.96 * estimate.standard_error


def test_anticorrelated_series_counts_as_independent_not_as_few() -> None:
    swinging = np.tile([0.0, 1.0], 200)
    estimate = mean_estimate(swinging)
    assert estimate.autocorrelation_time == 1.0
    assert estimate.effective_samples == 400.0
    assert estimate.mean == 0.5
    # The floor at 1 makes it the error of independent samples.
    assert estimate.standard_error == pytest.approx(0.5 / np.sqrt(399))
    for seed in range(20):
        noise = autoregressive(np.random.default_rng(seed), 200, -0.7)
        assert mean_estimate(noise).effective_samples > 150


@pytest.mark.parametrize("level", [0.0, 0.1, -3e-9, 1e12])
def test_constant_series_has_no_error(level: float) -> None:
    estimate = mean_estimate(np.full(333, level))
    assert estimate.mean == pytest.approx(level, rel=1e-14)  # a sum of 333 rounds a little
    assert (estimate.standard_error, estimate.ci95) == (0.0, 0.0)
    assert estimate.effective_samples == 333.0


def test_one_sample_tells_nothing_about_its_error() -> None:
    estimate = mean_estimate([2.0])
    assert estimate.mean == 2.0
    assert np.isinf(estimate.ci95)


@pytest.mark.parametrize("bad", [[], [[1.0, 2.0]], [1.0, np.nan], [np.inf, 1.0]])
def test_what_is_not_a_series_is_refused(bad: list) -> None:
    with pytest.raises(ValueError, match="a series"):
        mean_estimate(bad)


def test_shape_is_recovered_exactly_without_noise_and_next_to_others() -> None:
    x = np.linspace(0.0, 1.0, 150)
    found = fit_shape(7.0 + 2.0 * x - 0.3 * x**2, [x, x**2])
    assert found.value == pytest.approx(-0.3, rel=1e-9)  # rounding, enlarged by x being like x²
    assert found.half_width < 1e-9


def test_flat_series_contains_no_shape() -> None:
    found = fit_shape(np.full(60, 0.1), np.arange(60.0))
    assert (found.value, found.half_width) == (0.0, 0.0)


def test_fit_does_not_depend_on_units() -> None:
    series = np.cumsum(np.random.default_rng(5).standard_normal(300))
    x = np.linspace(0.0, 1.0, 300)
    here = fit_shape(series, x)
    there = fit_shape(1e-9 * series + 4.0e-7, x)
    assert there.value == pytest.approx(1e-9 * here.value, rel=1e-6)  # offset costs ~9 digits
    assert there.half_width == pytest.approx(1e-9 * here.half_width, rel=1e-5)  # brentq's 1e-6


@pytest.mark.parametrize("noise", ["random walk", "white"])
def test_slope_is_nearly_as_good_as_the_best_for_its_noise(noise: str) -> None:
    """Best is the end points for a random walk, and ordinary least squares for white noise."""
    x = np.linspace(0.0, 1.0, 400)
    best, here, widths = [], [], []
    for seed in range(SEEDS):
        series = np.random.default_rng(seed).standard_normal(400)
        if noise == "random walk":
            series = np.cumsum(series)
            best.append(series[-1] - series[0])
        else:
            best.append(np.polyfit(x, series, 1)[0])
        found = fit_shape(series, x)
        here.append(found.value)
        widths.append(found.half_width)
    # The two scatters come from the same noise, so that their ratio is known better than the
    # 3.5 % of a standard deviation from 400. The 24 cosines alone cost 1 %.
    assert np.std(here) <= 1.08 * np.std(best)
    # Nor is the interval bought with width: 1.96 for a normal error, 2.07 for Student's.
    assert np.median(widths) <= 2.5 * np.std(best)


def test_random_walk_under_jitter_is_not_taken_for_a_noisy_line() -> None:
    """The hard case: jitter of ten steps hides the walk from all but the slowest cosines."""
    x = np.linspace(0.0, 1.0, 200)
    hits = []
    for seed in range(SEEDS):
        rng = np.random.default_rng([seed, 200])
        walk = np.cumsum(rng.standard_normal(200))
        found = fit_shape(walk + 10.0 * rng.standard_normal(200), x)
        hits.append(abs(found.value) <= found.half_width)
    # Known to be below 95 % (see the docstring): 82 %, scatter 1.9 %, and 76 % if the colours with
    # jitter are left out.
    assert coverage(hits) >= 0.79


def test_smallest_numbers_do_not_upset_it() -> None:
    series = 1e-200 * np.random.default_rng(8).standard_normal(60)
    found = fit_shape(series, np.linspace(0.0, 1.0, 60))
    assert np.isfinite([found.value, found.half_width]).all()


def test_confidence_widens_the_interval() -> None:
    series = np.random.default_rng(8).standard_normal(200)
    x = np.linspace(0.0, 1.0, 200)
    widths = [fit_shape(series, x, level).half_width for level in (0.5, 0.95, 0.99)]
    assert widths == sorted(widths)
    assert widths[0] < 0.5 * widths[1]  # 0.67 against 1.96 for a normal error


def test_ruling_out_a_random_walk_narrows_the_interval() -> None:
    series = np.cumsum(np.random.default_rng(9).standard_normal(200))
    x = np.linspace(0.0, 1.0, 200)
    wandering, stationary = fit_shape(series, x), fit_shape(series, x, stationary=True)
    assert stationary.half_width < wandering.half_width


def test_too_few_samples_for_a_shape() -> None:
    with pytest.raises(ValueError, match="19 samples are too few"):
        fit_shape(np.arange(19.0), np.arange(19.0))
