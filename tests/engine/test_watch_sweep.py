"""A sweep with one point that goes wrong: it alone is stopped, and the table says why."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest
from small_scenes import GONE, INFILTRATION, changed

from liggghts_driver.engine.stop import Stop
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.sweeps.local import cores_here, run_local
from liggghts_driver.sweeps.plan import make_plan
from liggghts_driver.sweeps.table import points_table
from liggghts_driver.sweeps.tasks import task_of

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.engine

#: A piston against particles; with contacts a hundred thousand times softer it goes through them.
#: All points have one step, so that the soft one has as many of them before it.
SCENE = changed(INFILTRATION, {
    "piston.acceleration": 0.5, "time.duration": 1.6, "time.step": 4e-5, "fluid": GONE,
    "pressure": GONE, "contact.largest_overlap": 0.05,
    "output": {"samples": 160, "frames": 80, "images": 0},
})  # fmt: skip
SWEEP = """
scene = "scene.json"

[[axes]]
key = "contact.stiffness_scale"
values = [1.0, 1e-5, 0.5]
"""


def test_one_bad_point_stops_none_of_its_neighbours(tmp_path: Path) -> None:
    (tmp_path / "scene.json").write_text(json.dumps(SCENE))
    (tmp_path / "sweep.toml").write_text(SWEEP)
    plan = make_plan(tmp_path / "sweep.toml")
    tasks = [task_of(plan, point, tmp_path / "runs") for point in plan.points]
    cores = [cores_here()[n % len(cores_here())] for n in range(len(tasks))]  # side by side
    outcomes = run_local(tasks, Stop(), retries=1, cores=cores)
    assert [outcomes[task.name].ending for task in tasks] == ["done", "failed", "done"]
    bad = RunDirectory(tasks[1].folder).read_state()
    # A sphere may be lost before anybody looks; what was seen before that is told then.
    assert bad["diagnosis"]["rule"] in {"overlap", "lost"}
    assert bad["diagnosis"]["step"] < 36_000  # of 40,000
    assert bad["failures"] == 1  # it would go the same way again
    table = points_table(plan, tmp_path / "runs")
    assert table["state"].tolist() == ["done", "failed", "done"]
    assert table["reason"][1] == bad["faults"][0] == outcomes[tasks[1].name].reason
    assert table["verdict"].notna().tolist() == [True, False, True]
    for task in (tasks[0], tasks[2]):
        state = RunDirectory(task.folder).read_state()
        assert (state["state"], state["failures"]) == ("complete", 0)
