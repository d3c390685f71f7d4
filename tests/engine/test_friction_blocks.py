"""Friction slows the particles at the inlet and all but blocks it, as in the paper's Fig. 6."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from liggghts_driver.case import make_case
from liggghts_driver.resources import cases_dir
from liggghts_driver.results.series import complete_series, read_series
from liggghts_driver.run import run_case
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.scene import read_scene

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd

pytestmark = [pytest.mark.engine, pytest.mark.validate]

#: The paper's coefficients, and none.
FRICTIONS = (0.0, 0.1, 0.2, 0.5)


def series_with(friction: float, folder: Path) -> pd.DataFrame:
    rolling = 0.05 if friction else 0.0
    overrides = [
        f"contact.friction={friction}",
        f"contact.rolling_friction={rolling}",
        "output.images=0",
        "time.step_fraction=0.2",
    ]
    case = make_case(read_scene(cases_dir() / "infiltration_small.toml", overrides))
    run = run_case(case, RunDirectory(folder))
    return complete_series(read_series(run.directory.engine_series), case)


def test_more_friction_lets_less_in(tmp_path: Path) -> None:
    """With every step of friction less has entered, and at the end less still enters."""
    entered, late = [], []
    for friction in FRICTIONS:
        series = series_with(friction, tmp_path / f"mu-{friction}")
        volume = series["volume_entrance_m3"].to_numpy()
        time = series["time_s"].to_numpy()
        entered.append(volume[-1])
        last = time > 0.75 * time[-1]
        late.append(np.polyfit(time[last], volume[last], 1)[0])
        # Figures for the documentation: shown with `pytest -s`.
        print(f"\nfriction {friction}: {volume[-1]:.3e} m3, at the end {late[-1]:.3e} m3/s")  # noqa: T201
    assert np.all(np.diff(entered) < 0.0)
    assert np.all(np.diff(late) < 0.0)
    # All but blocked: an eighth of the rate without friction was measured in the last quarter. A
    # quarter leaves room for another packing.
    assert late[-1] < 0.25 * late[0]
