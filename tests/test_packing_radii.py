"""The truncated Gaussian: its samples, its limits and its mean volume."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import integrate, stats

from liggghts_driver.errors import PackingError
from liggghts_driver.packing import mean_sphere_volume, sample_radii


@pytest.mark.parametrize("truncation", [0.8, 3.0])
def test_samples_follow_the_distribution(truncation):
    radii = sample_radii(1.5e-3, 1e-4, 20_000, np.random.default_rng(7), truncation)
    exact = stats.truncnorm(-truncation, truncation, loc=1.5e-3, scale=1e-4)
    # A correct sampler falls below one per cent for one seed in a hundred; this seed does not.
    # 20,000 samples tell a deviation that is 5 % off, or clipping in place of truncation.
    assert stats.kstest(radii, exact.cdf).pvalue > 0.01


def test_samples_stay_within_the_truncation():
    radii = sample_radii(0.01, 0.001, 50_000, np.random.default_rng(3), 2.0)
    assert radii.min() >= 0.008
    assert radii.max() <= 0.012
    # The ends are approached, so the interval is not narrower than asked: with 50,000 samples
    # about 50 lie within a hundredth of a deviation of each end.
    assert radii.min() < 0.008 + 1e-5
    assert radii.max() > 0.012 - 1e-5


def test_no_deviation_gives_equal_radii():
    radii = sample_radii(0.01, 0.0, 5, np.random.default_rng(0))
    assert np.array_equal(radii, np.full(5, 0.01))


def test_same_seed_gives_the_same_bytes():
    first, again, other = (
        sample_radii(0.01, 0.001, 100, np.random.default_rng(seed)) for seed in (5, 5, 6)
    )
    assert first.tobytes() == again.tobytes()
    assert first.tobytes() != other.tobytes()


@given(
    mean=st.floats(1e-4, 1.0),
    relative=st.floats(0.0, 0.3),
    truncation=st.floats(0.1, 3.3),
)
def test_mean_volume_is_the_integral(mean, relative, truncation):
    def weighted(z: float) -> float:
        return float((1.0 + relative * z) ** 3 * np.exp(-0.5 * z * z))

    above, _ = integrate.quad(weighted, -truncation, truncation)
    below, _ = integrate.quad(lambda z: float(np.exp(-0.5 * z * z)), -truncation, truncation)
    expected = 4.0 / 3.0 * np.pi * mean**3 * above / below
    # Both sides are exact to rounding; quad promises 1.5e-8.
    assert mean_sphere_volume(mean, relative * mean, truncation) == pytest.approx(
        expected, rel=1e-8
    )


def test_count_and_mean_volume_give_the_reservoir_of_the_paper():
    # 21,500 particles at v_p = 0.15 in a channel of 0.1 x 0.1 m: about 0.205 m long.
    length = 21_500 * mean_sphere_volume(1.5e-3, 1e-4) / 0.15 / 0.01
    assert length == pytest.approx(0.205, abs=5e-4)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ((0.0, 0.0, 1), "mean radius"),
        ((float("nan"), 0.0, 1), "mean radius"),
        ((0.01, -1e-3, 1), "deviation"),
        ((0.01, 0.004, 1), "no positive radius"),
        ((0.01, 0.001, 0), "at least one"),
    ],
)
def test_senseless_distributions_are_refused(arguments, reason):
    with pytest.raises(PackingError, match=reason):
        sample_radii(*arguments, np.random.default_rng(0))


def test_senseless_truncation_is_refused():
    with pytest.raises(PackingError, match="truncation"):
        mean_sphere_volume(0.01, 0.001, 0.0)
