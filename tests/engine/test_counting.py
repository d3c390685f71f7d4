"""One small infiltration, seen in different ways: engine's sums, frames, one rank and two."""

from __future__ import annotations

import os
import shutil
from typing import TYPE_CHECKING

import numpy as np
import pytest

from liggghts_driver.results.positions import volumes_past_sections

if TYPE_CHECKING:
    from .support import Outcome, Simulator, Tables

pytestmark = pytest.mark.engine


def infiltration(duration_s: float) -> Tables:
    """283 particles pressed into a specimen of 0.03 m; soft, for a long step."""
    return {
        "seed": 1,
        "fluid": {"density": 2000.0, "viscosity": 1e-3, "velocity_outside": "piston"},
        "particles": {
            "density": 7000.0,
            "youngs_modulus": 1e6,
            "poissons_ratio": 0.25,
            "radius_mean": 1.5e-3,
            "radius_deviation": 1e-4,
            "volume_fraction": 0.15,
        },
        "grains": {
            "youngs_modulus": 1e6,
            "poissons_ratio": 0.25,
            "radius_mean": 5e-3,
            "radius_deviation": 5e-4,
        },
        "reservoir": {"length": 0.03},
        "specimen": {
            "length": 0.03,
            "width": 0.03,
            "solid_fraction": 0.45,
            "permeability_grains": 1e-9,
            "permeability_matrix": 1e-6,
        },
        "piston": {"acceleration": 2.143e-3},
        "pressure": {"gradient": 20.0},
        "contact": {"damping_ratio": 0.1},
        "time": {"duration": duration_s, "step_fraction": 0.2},
        "output": {"samples": 100, "frames": 50, "images": 0},
    }


@pytest.fixture(scope="module")
def infiltrated(simulator: Simulator) -> Outcome:
    return simulator.run(infiltration(8.0))


def test_the_two_ways_of_counting_agree(infiltrated: Outcome) -> None:
    """Volumes past the sections: summed by the engine, and counted from the frames."""
    counted = volumes_past_sections(infiltrated.directory, infiltrated.case)
    both = infiltrated.series.merge(counted, on="step", suffixes=("", "_counted"))
    assert len(both) == len(counted) == 51
    volumes = infiltrated.case.population.particle_volume_m3
    for section in ("entrance", "middle"):
        summed = both[f"volume_{section}_m3"].to_numpy()
        assert summed.max() > 0.0  # there is something to count
        # Rounding of a sum of 283 numbers, taken in another order.
        rounding = 283 * np.finfo(float).eps * volumes
        assert both[f"volume_{section}_m3_counted"].to_numpy() == pytest.approx(
            summed, abs=rounding
        )


def test_series_and_frames_agree(infiltrated: Outcome) -> None:
    """Particles inside, how many of them flow and how fast, and the largest speed of all."""
    series = infiltrated.series.set_index("step")
    threshold = 0.1 * 4.631e-3  # a tenth of the free-flight speed at 20 Pa/m
    steps = np.round(infiltrated.times_s / infiltrated.case.time.step_s).astype(int)
    frames = zip(
        steps[1:], infiltrated.positions_m[1:], infiltrated.velocities_m_s[1:], strict=True
    )
    for step, x, v in frames:
        row = series.loc[step]
        inside = (x[:, 0] > 0.0) & (x[:, 0] < 0.03)
        flowing = inside & (v[:, 0] > threshold)
        assert row["inside"] == inside.sum()
        # One particle may be within the threshold's fourth digit.
        assert row["flowing"] == pytest.approx(flowing.sum(), abs=1)
        assert row["largest_speed_m_s"] == pytest.approx(np.linalg.norm(v, axis=1).max(), rel=1e-12)
        if row["flowing"] == flowing.sum() > 0:
            mean = v[flowing, 0].mean()
            assert row["flowing_velocity_m_s"] == pytest.approx(mean, rel=1e-12)


def test_one_and_two_ranks_agree(simulator: Simulator) -> None:
    """The same particles, cut into two halves by y: what meets whom does not depend on it."""
    if shutil.which("mpirun") is None and not os.environ.get("CI"):
        pytest.skip("not on the PATH: mpirun")
    tables = infiltration(1.0)
    one, two = simulator.run(tables), simulator.run(tables, ranks=2)
    # Rounding, by sums taken in another order, grows in a chaotic system; within a second of
    # few contacts it stays far below a millionth of a radius (and is nil in practice).
    assert two.positions_m == pytest.approx(one.positions_m, abs=1e-6 * 1.5e-3)
    assert np.abs(one.positions_m[-1] - one.positions_m[0]).max() > 1e-4  # something moved
    for name in one.series.columns:
        assert two.series[name].to_numpy() == pytest.approx(
            one.series[name].to_numpy(), rel=1e-6, abs=1e-15, nan_ok=True
        )
