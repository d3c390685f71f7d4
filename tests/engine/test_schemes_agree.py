"""The three drag schemes on the small infiltration case: as like as two runs of one scheme.

A granular flow is chaotic: a particle moved by a hair takes another way after a few collisions.
How far two runs of one scheme part is measured with replicates whose particles start up to a
millionth of their radius aside; a scheme that solved another problem would part further.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from scipy import stats

from liggghts_driver.case import Case, make_case
from liggghts_driver.resources import cases_dir
from liggghts_driver.results.series import complete_series, read_series
from liggghts_driver.run import run_case
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.scene import read_scene

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

pytestmark = [pytest.mark.engine, pytest.mark.validate]

REPLICATES = 6
#: Simulated times [s] at which the volumes are compared; the small case lasts 20 s.
TIMES = (5.0, 10.0, 15.0, 20.0)
SECTIONS = ("entrance", "middle")


def case_with(scheme: str) -> Case:
    overrides = [f"drag.scheme={scheme}", "output.images=0", "time.step_fraction=0.2"]
    return make_case(read_scene(cases_dir() / "infiltration_small.toml", overrides))


def moved(case: Case, seed: int) -> Case:
    """The case with every particle a hair aside."""
    population = case.population
    centres = population.centres_m.copy()
    particles = population.particles
    aside = np.random.default_rng(seed).uniform(-1e-6, 1e-6, (particles, 3))
    centres[:particles] += aside * population.particle_radii_m[:, np.newaxis]
    return replace(case, population=replace(population, centres_m=centres))


def volumes(case: Case, folder: Path) -> NDArray[np.float64]:
    """Volume past each section at each time ``(sections, times)`` [m3]."""
    run = run_case(case, RunDirectory(folder))
    series = complete_series(read_series(run.directory.engine_series), case)
    return np.array(
        [np.interp(TIMES, series["time_s"], series[f"volume_{s}_m3"]) for s in SECTIONS]
    )


def test_the_schemes_agree_within_the_noise_of_replicates(tmp_path: Path) -> None:
    held = case_with("held")
    same = np.array([volumes(moved(held, n), tmp_path / f"held-{n}") for n in range(REPLICATES)])
    mean, spread = same.mean(axis=0), same.std(axis=0, ddof=1)
    # One more run of the same kind falls within this with 95 % for all sixteen numbers together
    # (Bonferroni): Student's t for a prediction from so few replicates.
    t = stats.t.ppf(1.0 - 0.05 / (2 * 2 * mean.size), REPLICATES - 1)
    noise = t * spread * np.sqrt(1.0 + 1.0 / REPLICATES)
    # Figures for the documentation: shown with `pytest -s`.
    final = mean[:, -1:]
    print(f"\nheld: {mean} m3, spread over the final {spread / final}")  # noqa: T201
    for scheme in ("implicit", "exact"):
        off = volumes(case_with(scheme), tmp_path / scheme) - mean
        print(f"{scheme}: off by {off / final} of {noise / final} allowed")  # noqa: T201
        # Equal where nothing has come yet.
        assert np.all(np.abs(off) <= noise), scheme
    # The comparison could tell: the noise is small beside what is compared.
    assert np.all(noise < 0.1 * final)
