"""A run that was interrupted and went on is the run that was not interrupted.

The continued run computes the forces of its checkpoint again, from the same places and velocities;
so it starts with the same numbers but for rounding, and sums forces in another order. In what
follows rounding errors grow as they would anyway: each collision multiplies them, some hundredfold
here. The runs are compared as long as that leaves many digits.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from small_scenes import INFILTRATION, case_of

from liggghts_driver import attempt
from liggghts_driver.engine.stop import Stop
from liggghts_driver.errors import RunInterrupted
from liggghts_driver.results.series import read_run_series
from liggghts_driver.run import run_case
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.timestep import frame_steps
from liggghts_driver.written import write_deck

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    import pandas as pd

    from liggghts_driver.case import Case
    from liggghts_driver.deck.build import Deck
    from liggghts_driver.run import FinishedRun

pytestmark = pytest.mark.engine

#: The piston runs into the particles within the first half second, and they into each other.
BUSY = {"piston.acceleration": 0.02, "time.duration": 1.6, "output.samples": 32}
SPHERES = [
    {"radius": 1.5e-3, "position": [0.0, 0.0, -8.5e-3], "velocity": [0.05, 0.02, 0.0]},
    {"radius": 1.5e-3, "position": [4e-3, 0.0, -8.5e-3], "spin": [0.0, 30.0, 5.0]},
]
#: Spheres that slide and roll over a floor, each with a spring to it in the engine's memory.
ROLLING: dict[str, Any] = {
    "particles": {"density": 7000.0, "youngs_modulus": 1e7, "poissons_ratio": 0.25},
    "spheres": SPHERES,
    "contact": {"damping_ratio": 0.1, "friction": 0.3, "rolling_friction": 0.02},
    "gravity": {"acceleration": [0.0, 0.0, -9.81]},
    "box": {"low": [-0.02, -0.02, -0.01], "high": [0.05, 0.03, 0.01], "walls": ["z-"]},
    "time": {"duration": 0.2},
    "output": {"samples": 40, "frames": 10, "images": 0},
}


class Wished(Stop):
    """A wish that stands from the start and asks for nothing: the engine has been asked before.

    A driver that asks while the engine runs comes too late where the engine is quick. Those ways
    are tested below and with a stand-in for the engine.
    """

    def __init__(self) -> None:
        super().__init__()
        self.asked = True

    def watch(self, ask: Callable[[], None]) -> Callable[[], None]:
        return lambda: None


def asked_at(step: int, case: Case, deck: Deck, run: RunDirectory) -> None:
    """Write a deck whose engine comes to its checkpoint after the first piece that ends there."""
    write_deck(case, deck, run)
    last = deck.files["checkpoint.in"].splitlines()
    run.control.write_text(
        f"variable now equal step\nif '${{now}} < {step}' then 'jump pieces.in'\n"
        + "\n".join(last)
        + "\n"
    )


def interrupted(case: Case, run: RunDirectory, shares: list[float], ranks: int = 1) -> FinishedRun:
    """Run a case that is asked to end at these shares of its steps, each time from where it was."""
    for share in shares:
        wanted = partial(asked_at, round(share * case.time.steps))
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(attempt, "write_deck", wanted)
            with pytest.raises(RunInterrupted, match="checkpoint"):
                run_case(case, run, ranks, stop=Wished())
        assert run.read_state()["state"] == "interrupted"
    return run_case(case, run, ranks)


def both(
    case: Case, folder: Path, shares: list[float], ranks: int = 1
) -> tuple[RunDirectory, RunDirectory]:
    """The same case run whole and in parts."""
    whole, parts = RunDirectory(folder / "whole"), RunDirectory(folder / "parts")
    run_case(case, whole, ranks)
    finished = interrupted(case, parts, shares, ranks)
    assert not finished.reused
    assert parts.read_state()["continuations"] == len(shares)
    assert parts.read_state()["failures"] == 0
    return whole, parts


def differences(whole: RunDirectory, parts: RunDirectory) -> pd.DataFrame:
    """Of the two series, each column over its largest value."""
    one, other = read_run_series(whole), read_run_series(parts)
    assert one["step"].tolist() == other["step"].tolist()
    return (one - other).abs() / one.abs().max().replace(0.0, 1.0)


@pytest.mark.parametrize(
    "changes",
    [
        {"drag.scheme": "held"},
        {"drag.scheme": "implicit"},
        {"drag.scheme": "exact", "particles.count": 12, "reservoir.length": 0.012},
        {"fluid.velocity_outside": "accelerating"},
        {"fluid.velocity_inside": "pore", "specimen.exit": "open"},
        {"drag.carrier": "addforce", "drag.scheme": "held"},
    ],
    ids=lambda changes: "-".join(map(str, changes.values())),
)
def test_the_piston_and_the_drag_go_on(tmp_path: Path, changes: dict[str, Any]) -> None:
    case = case_of(INFILTRATION, {**BUSY, **changes})
    whole, parts = both(case, tmp_path, [0.44, 0.47, 0.5])
    series, half = read_run_series(whole), BUSY["output.samples"] // 2
    free = BUSY["piston.acceleration"] * (case.time.step_s * series["step"][half - 1]) ** 2 / 2.0
    way = series["piston_x_m"][half - 1] - case.layout.low[0]
    assert way < 0.99 * free  # it has met particles by then
    after = differences(whole, parts).to_numpy()
    assert after[: int(0.4 * len(after))].max() == 0.0  # before the first interruption: one run
    assert after[: half + 3].max() < 1e-9


def test_the_piston_alone_goes_on_to_the_last_digit(tmp_path: Path) -> None:
    """Nothing multiplies errors here: a free piston, its place a sum of as many terms as steps."""
    scene = {"particles.count": 1, "reservoir.length": 0.3, **BUSY, "time.duration": 1.0}
    whole, parts = both(case_of(INFILTRATION, scene), tmp_path, [0.2, 0.4, 0.6, 0.8])
    places = [read_run_series(run)["piston_x_m"].to_numpy() for run in (whole, parts)]
    steps = case_of(INFILTRATION, scene).time.steps
    assert places[1] == pytest.approx(places[0], rel=steps * np.finfo(float).eps)


def test_friction_goes_on(tmp_path: Path) -> None:
    case = case_of(ROLLING)
    whole, parts = both(case, tmp_path, [0.3, 0.6])
    # Two spheres on a plane: no chaos, only rounding, which springs and dashpots keep small.
    assert differences(whole, parts).to_numpy().max() < 1e-9
    one, other = (run.frame_files() for run in (whole, parts))
    assert [path.name for path in one] == [path.name for path in other]


def test_two_ranks_go_on(tmp_path: Path) -> None:
    case = case_of(INFILTRATION, BUSY)
    whole, parts = both(case, tmp_path, [0.5], ranks=2)
    after = differences(whole, parts)
    half = len(after) // 2
    assert after.iloc[half : half + 3].to_numpy().max() < 1e-9


def test_checkpoints_now_and_then(tmp_path: Path) -> None:
    """Nobody wishes the run to end: it goes on by itself, and what it keeps is the last one."""
    # Long enough for a checkpoint on a fast machine, where 1.6 s were simulated in half a second.
    longer = {"particles.count": 300, "reservoir.length": 0.1, "time.duration": 4.0}
    case = case_of(INFILTRATION, {**BUSY, **longer})
    run = RunDirectory(tmp_path / "run")
    run_case(case, run, stop=Stop(checkpoint_every_s=0.5))
    assert run.read_state()["continuations"] >= 1
    assert not list(run.path.rglob("*.restart"))  # a finished run needs none
    assert len(run.frame_files()) == len(frame_steps(case.time))
