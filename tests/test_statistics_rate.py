"""Flow rates and means: do 95 % intervals hold the truth in 95 of 100 simulated experiments?"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import pytest
from scipy.signal import lfilter

from liggghts_driver.statistics import flow_rate, series_mean

if TYPE_CHECKING:
    from collections.abc import Callable

SEEDS = 600
SAMPLES = 300
INTERVAL_S = 0.15
RATE_M3_S = 1.6e-6
PARTICLE_M3 = 1.4e-8
PER_SAMPLE_M3 = RATE_M3_S * INTERVAL_S  # 17 particles

TIME_S = INTERVAL_S * np.arange(SAMPLES)

# With a true coverage of 95 %, 600 trials scatter by sqrt(0.95 * 0.05/600) = 0.9 %. Intervals from
# about twenty cosines of a noise of unknown colour are themselves only good to 2 %: 2000 other
# trials of each case gave 93.7 % (walks, with a start to be found) to 97.0 % (lines read with
# noise; scatter 0.7 %). So 90 to 98 % is 4 scatters below the least and 1.4 above the most.
LEAST, MOST = 0.90, 0.98

Curve: TypeAlias = "Callable[[np.random.Generator], np.ndarray]"


def autoregressive(rng: np.random.Generator, n: int, phi: float) -> np.ndarray:
    """Stationary x[i] = phi x[i-1] + unit white noise."""
    before = rng.standard_normal() / np.sqrt(1.0 - phi**2)
    return lfilter([1.0], [1.0, -phi], rng.standard_normal(n), zi=[phi * before])[0]


def arrivals(rng: np.random.Generator, share: np.ndarray) -> np.ndarray:
    """Compound Poisson: particles of random volume come at ``share`` times the steady rate."""
    numbers = rng.poisson(PER_SAMPLE_M3 / PARTICLE_M3 * share)
    volumes = PARTICLE_M3 * rng.uniform(0.6, 1.4, numbers.sum())
    total = np.concatenate([[0.0], np.cumsum(volumes)])
    return total[np.concatenate([[0], np.cumsum(numbers)])]


def random_arrivals(rng: np.random.Generator) -> np.ndarray:
    return arrivals(rng, np.ones(SAMPLES - 1))


def line_and_white_noise(rng: np.random.Generator) -> np.ndarray:
    return RATE_M3_S * TIME_S + 2.0 * PARTICLE_M3 * rng.standard_normal(SAMPLES)


def line_and_slow_noise(rng: np.random.Generator) -> np.ndarray:
    return RATE_M3_S * TIME_S + 2.0 * PARTICLE_M3 * autoregressive(rng, SAMPLES, 0.7)


def slow_increments(rng: np.random.Generator) -> np.ndarray:
    return np.cumsum(PER_SAMPLE_M3 * (1.0 + 0.25 * autoregressive(rng, SAMPLES, 0.6)))


def piled_up_start(rng: np.random.Generator) -> np.ndarray:
    """Fast at first, then nearly stopped by the pile at the inlet, then steady."""
    moment = np.arange(SAMPLES - 1) / SAMPLES
    return arrivals(rng, np.select([moment < 0.1, moment < 0.25], [4.0, 0.3], 1.0))


def arrivals_read_with_jitter(rng: np.random.Generator) -> np.ndarray:
    return random_arrivals(rng) + 5.0 * PARTICLE_M3 * rng.standard_normal(SAMPLES)


@pytest.mark.parametrize(
    "curve",
    [
        random_arrivals,
        line_and_white_noise,
        line_and_slow_noise,
        slow_increments,
        piled_up_start,
        arrivals_read_with_jitter,
    ],
)
def test_interval_of_the_flow_rate_holds_the_truth(curve: Curve) -> None:
    found = [flow_rate(TIME_S, curve(np.random.default_rng([s, 23]))) for s in range(SEEDS)]
    hits = np.mean([abs(rate.mean_m3_s - RATE_M3_S) <= rate.ci95_m3_s for rate in found])
    assert LEAST <= hits <= MOST
    # At most 5 % of false alarms, and 2 % more for their own scatter (0.9 %) in 600 trials.
    assert np.mean([rate.steady for rate in found]) >= 0.93
    # The mean of 600 rates, whose errors are of the size of one interval's half width over 1.96;
    # and up to a third of that error as what a transient leaves behind.
    error = np.median([rate.ci95_m3_s for rate in found]) / 1.96
    assert abs(np.mean([rate.mean_m3_s for rate in found]) - RATE_M3_S) <= 0.33 * error


def test_interval_of_random_arrivals_is_that_of_counting() -> None:
    found = [flow_rate(TIME_S, random_arrivals(np.random.default_rng(seed))) for seed in range(100)]
    # N = 5126 particles with volumes of relative variance 0.8²/12: error sqrt((1 + 0.053)/N).
    counting = np.sqrt((1.0 + 0.8**2 / 12.0) / (RATE_M3_S * TIME_S[-1] / PARTICLE_M3))
    # Student's t instead of 1.96, a truncated start, and 10 % scatter from twenty cosines.
    ratio = np.median([rate.ci95_m3_s for rate in found]) / (1.96 * counting * RATE_M3_S)
    assert 0.9 <= ratio <= 1.25


def test_interval_of_a_noisy_line_is_that_of_least_squares() -> None:
    found = [
        flow_rate(TIME_S, line_and_white_noise(np.random.default_rng(seed))) for seed in range(100)
    ]
    least_squares = 2.0 * PARTICLE_M3 * np.sqrt(12.0 / SAMPLES) / TIME_S[-1]
    # A truncated start counts with the power 3/2; the noise's colour is not known to be white.
    ratio = np.median([rate.ci95_m3_s for rate in found]) / (1.96 * least_squares)
    assert 0.9 <= ratio <= 1.5


def test_piled_up_start_is_left_out() -> None:
    found = [flow_rate(TIME_S, piled_up_start(np.random.default_rng(seed))) for seed in range(50)]
    assert min(rate.steady_from_s for rate in found) >= 0.25 * SAMPLES * INTERVAL_S - 1.0
    assert {rate.steady_to_s for rate in found} == {TIME_S[-1]}


def test_the_whole_series_is_judged_where_it_is_asked_for() -> None:
    """The piled-up start with it: a kink, and the slope from end to end."""
    volume_m3 = RATE_M3_S * TIME_S + 20.0 * RATE_M3_S * np.minimum(TIME_S, 0.2 * TIME_S[-1])
    part, whole = (flow_rate(TIME_S, volume_m3, whole=each) for each in (False, True))
    assert (part.steady, whole.steady) == (True, False)
    assert (part.mean_m3_s, whole.steady_from_s) == (pytest.approx(RATE_M3_S), 0.0)
    assert whole.mean_m3_s > 2.0 * RATE_M3_S


@pytest.mark.parametrize("quantum_m3", [0.0, PARTICLE_M3])
def test_straight_line_is_exact_up_to_the_quantum(quantum_m3: float) -> None:
    rate = flow_rate(TIME_S + 7.0, 3e-5 + RATE_M3_S * TIME_S, quantum_m3)
    assert rate.steady
    assert rate.mean_m3_s == pytest.approx(RATE_M3_S, rel=1e-9)  # rounding
    assert (rate.steady_from_s, rate.steady_to_s) == (7.0, TIME_S[-1] + 7.0)
    # Three particles, from exp(-3.0) = 5 %.
    assert rate.ci95_m3_s == pytest.approx(
        -np.log(0.05) * quantum_m3 / TIME_S[-1], rel=1e-9, abs=1e-9 * RATE_M3_S
    )


@pytest.mark.parametrize("blocked_at", [1, 90, 150, 190])
def test_blocked_section_is_steady_with_rate_zero_and_an_honest_error(blocked_at: int) -> None:
    share = (np.arange(SAMPLES - 1) < blocked_at).astype(float)
    volume = arrivals(np.random.default_rng(1), share)
    rate = flow_rate(TIME_S, volume, PARTICLE_M3)
    assert rate.steady
    assert rate.mean_m3_s == 0.0
    assert rate.steady_from_s == pytest.approx(blocked_at * INTERVAL_S)
    length_s = rate.steady_to_s - rate.steady_from_s
    assert rate.ci95_m3_s >= PARTICLE_M3 / length_s
    assert flow_rate(TIME_S, volume).ci95_m3_s == 0.0


def test_section_blocked_near_the_end_is_not_steady() -> None:
    share = (np.arange(SAMPLES - 1) < 240).astype(float)
    for seed in range(20):
        assert not flow_rate(TIME_S, arrivals(np.random.default_rng(seed), share)).steady


def test_no_flow_at_all() -> None:
    rate = flow_rate(TIME_S, np.zeros(SAMPLES), PARTICLE_M3)
    assert (rate.steady, rate.mean_m3_s, rate.steady_from_s) == (True, 0.0, 0.0)
    assert rate.ci95_m3_s > 0.0


def test_decaying_flow_is_not_steady() -> None:
    for volume in (1e-6 * np.sqrt(TIME_S), 1e-5 * -np.expm1(-TIME_S / TIME_S[-1])):
        rate = flow_rate(TIME_S, volume, PARTICLE_M3)
        assert not rate.steady
        assert rate.reason.startswith("drifts")
        assert np.isfinite(rate.ci95_m3_s)


@pytest.mark.parametrize("n", [1, 2, 19])
def test_too_short_a_curve_is_an_answer(n: int) -> None:
    rate = flow_rate(TIME_S[:n], RATE_M3_S * TIME_S[:n], PARTICLE_M3)
    assert not rate.steady
    assert rate.reason.startswith("too short")
    assert np.isinf(rate.ci95_m3_s)
    if n > 1:
        assert rate.mean_m3_s == pytest.approx(RATE_M3_S)


def test_same_input_same_answer() -> None:
    volume = random_arrivals(np.random.default_rng(6))
    assert flow_rate(TIME_S, volume) == flow_rate(TIME_S, volume)


@pytest.mark.parametrize("phi", [0.0, 0.8])
def test_interval_of_a_mean_holds_the_truth_after_a_transient(phi: float) -> None:
    hits, reasons = [], []
    for seed in range(SEEDS):
        noise = autoregressive(np.random.default_rng([seed, 3]), SAMPLES, phi)
        mean = series_mean(TIME_S, 2.0 + np.exp(-TIME_S / 2.0) + 0.1 * noise)
        hits.append(abs(mean.mean - 2.0) <= mean.ci95)
        reasons.append(mean.reason)
    assert LEAST <= np.mean(hits) <= MOST
    drifts = np.mean([reason.startswith("drifts") for reason in reasons])
    short = np.mean([reason.startswith("too short") for reason in reasons])
    assert drifts <= 0.07  # as for the flow rate
    # At 0.8 (tau = 9) some 200 kept samples are 22 effective ones, estimated with a scatter of a
    # third: 1.4 % of 6000 other trials fell below the 10 that are asked for.
    assert short <= 0.03


def test_series_mean_reports_its_steady_part() -> None:
    values = np.full(SAMPLES, 3e-3) + 1e-4 * np.random.default_rng(1).standard_normal(SAMPLES)
    values[:10] = np.nan
    values[10:60] += 1e-2
    mean = series_mean(TIME_S, values)
    assert mean.dropped == 10
    assert mean.from_s >= TIME_S[60]
    kept = values[mean.from_s <= TIME_S]
    assert (mean.mean, mean.minimum, mean.maximum) == (kept.mean(), kept.min(), kept.max())
    assert mean.maximum < 5e-3
    assert mean.steady


def test_series_mean_of_a_ramp_and_of_nothing() -> None:
    ramp = series_mean(TIME_S, TIME_S)
    assert (ramp.steady, ramp.reason[:6]) == (False, "drifts")
    nothing = series_mean(TIME_S, np.full(SAMPLES, np.nan))
    assert (nothing.steady, nothing.dropped) == (False, SAMPLES)
    assert np.isnan(nothing.mean)
    assert nothing.reason.startswith("too short")
    few = series_mean(TIME_S[:12], [np.nan] * 4 + [1.0, 2.0] * 4)
    assert (few.steady, few.mean, few.dropped) == (False, 1.5, 4)


def test_gap_in_the_values_is_refused() -> None:
    values = np.ones(SAMPLES)
    values[50] = np.nan
    with pytest.raises(ValueError, match="a series is finite"):
        series_mean(TIME_S, values)


@pytest.mark.parametrize("use", [flow_rate, series_mean])
def test_times_must_be_uniform_and_belong_to_the_values(use: Callable[..., object]) -> None:
    rng = np.random.default_rng(0)
    values = np.cumsum(rng.random(SAMPLES))
    use(TIME_S + 1e-7 * INTERVAL_S * rng.uniform(-1.0, 1.0, SAMPLES), values)
    late = TIME_S.copy()
    late[100] += 1e-4 * INTERVAL_S
    with pytest.raises(ValueError, match="time is not uniform: sample 100"):
        use(late, values)
    with pytest.raises(ValueError, match="time does not grow"):
        use(TIME_S[::-1], values)
    with pytest.raises(ValueError, match="do not belong"):
        use(TIME_S[1:], values)


@pytest.mark.parametrize("quantum_m3", [-1e-9, np.nan, np.inf])
def test_quantum_is_a_volume(quantum_m3: float) -> None:
    with pytest.raises(ValueError, match="quantum_m3"):
        flow_rate(TIME_S, TIME_S, quantum_m3)
