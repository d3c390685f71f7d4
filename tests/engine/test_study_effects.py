"""The study of effects with the real engine: two dozen particles fall through a fluid in a box."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd
import pytest

from liggghts_driver.engine.stop import Stop
from liggghts_driver.scene import make_scene
from liggghts_driver.studies.effects import whole_case, write_results
from liggghts_driver.studies.measured import measure
from liggghts_driver.studies.tasks import run_tasks, tasks_in_turn
from liggghts_driver.studies.variants import variants_of

if TYPE_CHECKING:
    from .support import Tables

pytestmark = pytest.mark.engine

GRAVITY, DURATION = 0.5, 0.05
FALL: Tables = {
    "particles": {
        "density": 7000.0,
        "youngs_modulus": 1e7,
        "poissons_ratio": 0.25,
        "radius_mean": 0.0015,
        "radius_deviation": 0.0001,
        "count": 24,
    },
    "fluid": {"density": 2000.0, "viscosity": 0.001},
    "gravity": {"acceleration": [0.0, 0.0, -GRAVITY], "buoyancy": False},
    "contact": {"restitution": 0.5, "friction": 0.3},
    # High enough that nothing has reached the floor when the run ends: half g t^2 is 0.6 mm.
    "box": {
        "low": [-0.01, -0.01, 0.0],
        "high": [0.01, 0.01, 0.03],
        "walls": ["x-", "x+", "y-", "y+", "z+"],
    },
    "time": {"duration": DURATION},
    "output": {"samples": 20, "frames": 10, "images": 0},
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the study is."""
    return tmp_path_factory.mktemp("study")


@pytest.fixture(scope="module")
def results(folder: Path) -> dict[str, Any]:
    """The study, with two seeds."""
    scene = make_scene(FALL)
    tasks = tasks_in_turn(variants_of(scene), scene, (1, 2), folder / "runs")
    outcomes = run_tasks(list(tasks.values()), Stop())
    return write_results(scene, whole_case(scene), measure(tasks, outcomes), folder)


def test_each_effect_changes_what_it_should(results: dict[str, Any]) -> None:
    assert all(run["failure"] is None for run in results["runs"])
    found = {variant["name"]: variant for variant in results["variants"]}
    assert list(found) == ["all-effects", "without-friction", "without-drag", "without-gravity"]
    distance = {
        name: next(item for item in variant["observables"] if item["name"] == "distance_m")
        for name, variant in found.items()
    }
    # Without drag they fall freely, and none has met another: half g t^2. The duration is rounded
    # up to whole steps, and a step's error is less than one part in the number of steps.
    free = found["without-drag"]
    assert distance["without-drag"]["mean"] == pytest.approx(
        GRAVITY * DURATION**2 / 2.0, rel=2.0 / free["steps"]
    )
    # What the fluid holds back is missing with it, in every replicate.
    change = distance["without-drag"]["change"]
    assert change["mean"] - change["ci95"] > 0.0
    # Nobody touches anybody: friction changes nothing at all.
    assert distance["without-friction"]["change"]["mean"] == 0.0
    # Nothing else moves them.
    assert distance["without-gravity"]["mean"] == 0.0
    assert distance["without-gravity"]["change"]["mean"] == -1.0
    assert found["without-friction"]["time_ratio"]["replicates"] == 2


def test_its_files_agree(folder: Path, results: dict[str, Any]) -> None:
    table = pd.read_csv(folder / "effects.csv").set_index("variant")
    document = json.loads((folder / "effects.json").read_text(encoding="utf-8"))
    assert document == results
    for variant in results["variants"]:
        means = {item["name"]: item["mean"] for item in variant["observables"]}
        for name, mean in means.items():
            # What is printed is read back to the last digit.
            assert table.loc[variant["name"], name] == mean


def test_the_packing_is_that_of_the_seed(results: dict[str, Any]) -> None:
    runs = {seed: [run for run in results["runs"] if run["seed"] == seed] for seed in (1, 2)}
    assert [len(some) for some in runs.values()] == [4, 4]
    placed = [{atoms(Path(run["folder"])) for run in some} for some in runs.values()]
    assert [len(packings) for packings in placed] == [1, 1]
    assert placed[0] != placed[1]


def atoms(run: Path) -> str:
    """The spheres that the engine read."""
    text = (run / "particles.data").read_text(encoding="utf-8")
    return text.split("Atoms")[1].split("Velocities")[0]
