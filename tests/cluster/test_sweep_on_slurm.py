"""A sweep on a real Slurm of two nodes: what goes wrong on clusters goes wrong here."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import pytest
from small_scenes import COLLISION, INFILTRATION, Tables, changed

from liggghts_driver.results.series import read_run_series
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.sweeps.plan import read_plan
from liggghts_driver.sweeps.slurm import points_in_queue
from liggghts_driver.sweeps.status import points_by_state, run_states

from .slurm import wait_until

if TYPE_CHECKING:
    from pathlib import Path

    from .slurm import Cluster

pytestmark = pytest.mark.engine

#: The death of a node is noticed after twenty seconds and a requeued job waits ten; a machine that
#: is busy may take several times as long for its part.
TIMEOUT_S = 150.0
#: Some seconds of engine time, in many pieces: long enough to be met in the middle.
LONG = {"drag.scheme": "exact", "time.duration": 2.0, "output.samples": 200}


class Sweep:
    """A sweep in a folder of its own, driven by the command line as a user does."""

    def __init__(self, folder: Path, base: Tables, scene: dict[str, Any], text: str) -> None:
        self.folder = folder
        (folder / "scene.json").write_text(json.dumps(changed(base, scene)))
        (folder / "s.toml").write_text(f'scene = "scene.json"\n{text}')

    def command(self, *words: str) -> list[str]:
        return [sys.executable, "-m", "liggghts_driver", "sweep", *words]

    def __call__(self, *words: str, code: int | None = 0) -> dict[str, Any]:
        """Call a command with --json; what it printed."""
        done = subprocess.run(
            self.command(*words, "--json"),
            cwd=self.folder,
            capture_output=True,
            text=True,
            timeout=TIMEOUT_S,
            check=False,
        )
        assert code is None or done.returncode == code, done.stdout + done.stderr + self.outputs()
        return json.loads(done.stdout)

    def submit(self, *words: str) -> None:
        self("run", "s.toml", "--executor", "slurm", *words)

    @property
    def runs(self) -> list[RunDirectory]:
        """The run directories, in the order of the points."""
        plan = read_plan(self.folder / "runs" / "sweep-s")
        return [RunDirectory(self.folder / "runs" / "points" / p.run) for p in plan.points]

    def states(self) -> dict[str, int]:
        """How many points are in each state: what `sweep status` prints, without its start-up."""
        folder = self.folder / "runs" / "sweep-s"
        plan, queued = read_plan(folder), points_in_queue(folder)
        waiting = {plan.points[index].run: state for index, (_, state) in queued.items()}
        runs = {point.run for point in plan.points}
        states = run_states(runs, self.folder / "runs" / "points", waiting)
        return {state: count for state, count in points_by_state(plan, states).items() if count}

    def wait_for(self, **states: int) -> None:
        wait_until(lambda: self.states() == states, TIMEOUT_S, f"{states}{self.outputs()}")

    def wait_for_steps(self, run: RunDirectory, rows: int = 5) -> None:
        """Wait until a run has written some rows of its series."""

        def so_far() -> bool:
            path = run.engine_series
            return path.exists() and path.read_text().count("\n") > rows

        wait_until(so_far, TIMEOUT_S, f"{rows} rows of {run.path}{self.outputs()}")

    def outputs(self) -> str:
        """What the jobs printed, for the message of a failure."""
        files = sorted((self.folder / "runs" / "sweep-s" / "jobs").glob("*.out"))
        return "".join(f"\n--- {path.name}\n{path.read_text()}" for path in files)


def whole(run: RunDirectory) -> None:
    """A run is complete, its series without gaps or doubles."""
    assert run.read_state()["state"] == "complete"
    assert run.results.exists()
    steps = read_run_series(run)["step"].tolist()
    every = steps[0]
    assert steps == list(range(every, steps[-1] + 1, every))
    assert steps[-1] == run.read_state()["time"]["steps"]


def values(key: str, *numbers: float) -> str:
    return f'[[axes]]\nkey = "{key}"\nvalues = {list(numbers)}\n'


def test_an_array_on_two_nodes_with_two_ranks_each(cluster: Cluster, tmp_path: Path) -> None:
    text = "[resources]\nranks = 2\n" + values("pressure.gradient", 2.0, 4.0, 6.0, 8.0)
    sweep = Sweep(tmp_path, INFILTRATION, {}, text)
    sweep.submit("--wait")
    assert sweep.states() == {"done": 4}
    states = [run.read_state() for run in sweep.runs]
    assert {state["host"] for state in states} == {"node1", "node2"}
    assert {state["ranks"] for state in states} == {2}
    assert all("mpirun" in " ".join(state["command"]) for state in states)
    for run in sweep.runs:
        whole(run)
    # What is done is done: nothing is submitted again.
    sweep.submit()
    assert len(json.loads((tmp_path / "runs/sweep-s/jobs/submitted.json").read_text())) == 1


def test_a_node_dies_in_the_middle_of_a_run(cluster: Cluster, tmp_path: Path) -> None:
    sweep = Sweep(tmp_path, INFILTRATION, LONG, values("pressure.gradient", 2.0))
    sweep.submit()
    wait_until(lambda: sweep.states() == {"running": 1}, TIMEOUT_S, "a start")
    (run,) = sweep.runs
    sweep.wait_for_steps(run)
    node = run.read_state()["host"]
    cluster.kill_node(node)
    sweep.wait_for(done=1)
    state = run.read_state()
    assert state["host"] != node
    assert state["failures"] == 0  # the run had no fault
    whole(run)
    assert (run.path / "attempt-1" / "deck.in").exists()  # what the dead node left is kept


def test_a_walltime_cut(cluster: Cluster, tmp_path: Path) -> None:
    """Slurm's signal before the limit, here sent by hand; the job puts itself back and goes on."""
    text = "[resources]\nwalltime_s = 600.0\nranks = 2\n" + values("pressure.gradient", 2.0)
    sweep = Sweep(tmp_path, INFILTRATION, LONG, text)
    sweep.submit()
    wait_until(lambda: sweep.states() == {"running": 1}, TIMEOUT_S, "a start")
    (run,) = sweep.runs
    sweep.wait_for_steps(run)
    job = run.read_state()["job"]
    cluster.run("scancel", "--batch", "--signal=USR1", job)
    wait_until(lambda: len(run.segments()) == 1, TIMEOUT_S, f"a checkpoint{sweep.outputs()}")
    sweep.wait_for(done=1)
    state = run.read_state()
    assert (state["failures"], state["continuations"]) == (0, 1)
    assert state["job"] == job  # the same task, restarted
    whole(run)


def test_a_preempted_job_goes_on(cluster: Cluster, tmp_path: Path) -> None:
    text = '[slurm]\npartition = "low"\n'
    sweep = Sweep(tmp_path, INFILTRATION, LONG, text + values("pressure.gradient", 2.0, 4.0))
    sweep.submit()
    wait_until(lambda: sweep.states() == {"running": 2}, TIMEOUT_S, "both nodes busy")
    for run in sweep.runs:
        sweep.wait_for_steps(run)
    cluster.run("sbatch", "--partition=high", "-N2", "-n4", "--output=/dev/null", "--wrap=sleep 1")
    sweep.wait_for(done=2)
    for run in sweep.runs:
        state = run.read_state()
        assert (state["failures"], state["continuations"]) == (0, 1)
        whole(run)


def test_cancelled_then_finished_here_with_nothing_run_twice(
    cluster: Cluster, tmp_path: Path
) -> None:
    text = values("time.duration", 0.1, 2.0, 1.9, 1.8)
    sweep = Sweep(tmp_path, INFILTRATION, LONG, text)
    sweep.submit()
    wait_until(lambda: sweep.states().get("done") == 1, TIMEOUT_S, f"the first{sweep.outputs()}")
    first, *others = sweep.runs
    before = first.state.read_text()
    wait_until(
        lambda: sum(run.engine_series.exists() for run in others) >= 2, TIMEOUT_S, "the next two"
    )
    assert len(sweep("cancel", "s.toml")["cancelled"]) == 3
    over = {"done", "interrupted", "waiting"}  # and so no job is running, nor ends just now
    wait_until(lambda: sweep.states().keys() <= over, TIMEOUT_S, "the end of the jobs")
    states = sweep.states()
    assert states["done"] == 1
    assert states.get("interrupted", 0) >= 1
    held = {run.path: len(run.segments()) for run in others}
    sweep("run", "s.toml")  # here, on the cores of this machine
    assert sweep.states() == {"done": 4}
    assert first.state.read_text() == before
    for run in others:
        state = run.read_state()
        assert state["job"] is None
        assert (state["failures"], state["continuations"]) == (0, held[run.path])
        whole(run)


def test_a_bad_point_and_a_dead_submitter(cluster: Cluster, tmp_path: Path) -> None:
    """Nobody needs to stay: the cluster does the rest, and one bad point harms no other."""
    # The spheres of the second leave the box, which has no walls, and are lost.
    text = "[resources]\npack = 2\nretries = 1\n" + values("time.duration", 0.1, 20.0, 0.2, 0.3)
    sweep = Sweep(tmp_path, COLLISION, {}, text)
    words = sweep.command("run", "s.toml", "--executor", "slurm", "--wait")
    submitter = subprocess.Popen(
        words, cwd=tmp_path, stdout=subprocess.PIPE, text=True, env=dict(os.environ)
    )
    assert submitter.stdout is not None
    while "submitted" not in submitter.stdout.readline():
        assert submitter.poll() is None, sweep.outputs()
    submitter.send_signal(signal.SIGKILL)
    submitter.communicate(timeout=TIMEOUT_S)
    sweep.wait_for(done=3, failed=1)
    (trouble,) = sweep("status", "s.toml")["failed"]
    assert trouble["values"] == {"time.duration": 20.0}
    assert "spheres left the engine's box" in trouble["reason"]
    # It is not tried again: the same run would lose the same spheres.
    assert sweep.runs[1].read_state()["failures"] == 1
    sweep.submit()  # it has had its tries: nothing to submit
    assert len(json.loads((tmp_path / "runs/sweep-s/jobs/submitted.json").read_text())) == 1
    sweep("collect", "s.toml", code=1)  # one point has no answer
    table = (tmp_path / "runs/sweep-s/results.csv").read_text()
    assert table.count("done") == 3
    assert "failed" in table
