"""The runs of any study: their order, names and folders, and how they are run."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass

import pytest
from small_scenes import COLLISION, scene_of

from liggghts_driver.engine.stop import Stop
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.studies.tasks import core_s, run_tasks, tasks_in_turn, unfinished
from liggghts_driver.sweeps.plan import make_plan
from liggghts_driver.sweeps.task import Listener, Outcome
from liggghts_driver.sweeps.work import failures


@dataclass(frozen=True)
class Damped:
    """A way of running a scene: with another damping ratio."""

    ratio: float

    @property
    def title(self) -> str:
        return f"damped {self.ratio:g}"

    def scene(self, scene, seed):
        contact = scene.contact.model_copy(update={"damping_ratio": self.ratio})
        return scene.model_copy(update={"contact": contact, "seed": seed})


WAYS = (Damped(0.1), Damped(0.2))


@pytest.fixture
def tasks(tmp_path):
    """Both ways with two seeds."""
    return tasks_in_turn(WAYS, scene_of(COLLISION), (4, 5), tmp_path / "runs")


class Heard(Listener):
    """Notes what is at work, and on which cores."""

    def __init__(self) -> None:
        self.told: list[str] = []
        self.cores: set[frozenset[int]] = set()

    def on_start(self, task):
        self.told.append(f"start {task.name}")
        self.cores.add(frozenset(os.sched_getaffinity(0)))

    def on_end(self, task, outcome):
        self.told.append(f"end {task.name}")


def run_one_after_another(*names: str) -> list[str]:
    return [f"{what} {name}" for name in names for what in ("start", "end")]


NAMES = [f"damped {ratio}, seed {seed}" for seed in (4, 5) for ratio in (0.1, 0.2)]


class TestTasks:
    def test_all_ways_in_turn_for_one_seed_before_the_next(self, tasks):
        assert list(tasks) == [(way, seed) for seed in (4, 5) for way in WAYS]
        assert [task.name for task in tasks.values()] == NAMES

    def test_each_makes_its_scene(self, tasks):
        for (way, seed), task in tasks.items():
            scene = task.scene()
            assert (scene.contact.damping_ratio, scene.seed) == (way.ratio, seed)

    def test_a_sweep_over_the_same_has_the_same_runs(self, tasks, tmp_path):
        (tmp_path / "scene.json").write_text(json.dumps(COLLISION))
        sweep = tmp_path / "sweep.toml"
        axes = {"seed": [4, 5], "contact.damping_ratio": [0.1, 0.2]}
        sweep.write_text(
            'scene = "scene.json"\n'
            + "".join(f'[[axes]]\nkey = "{key}"\nvalues = {axes[key]}\n' for key in axes)
        )
        wanted = [tmp_path / "runs" / point.run for point in make_plan(sweep).points]
        assert [task.folder for task in tasks.values()] == wanted


class TestRunning:
    def test_one_after_another_on_one_core(self, tasks, engine):
        heard = Heard()
        outcomes = run_tasks(list(tasks.values()), Stop(), heard)
        assert outcomes == dict.fromkeys(NAMES, Outcome("done"))
        assert heard.told == run_one_after_another(*NAMES)
        assert [len(cores) for cores in heard.cores] == [1]

    def test_what_is_done_is_found_and_nobody_is_told(self, tasks, engine):
        run_tasks(list(tasks.values())[:2], Stop())
        assert [task.name for task in unfinished(list(tasks.values()))] == NAMES[2:]
        heard = Heard()
        outcomes = run_tasks(list(tasks.values()), Stop(), heard)
        assert [outcomes[name].reused for name in NAMES] == [True, True, False, False]
        assert heard.told == run_one_after_another(*NAMES[2:])

    def test_what_failed_is_tried_once_more_after_all_others(self, tasks, engine):
        first = next(iter(tasks.values()))
        engine("crash")
        for times in (1, 2):
            assert run_tasks([first], Stop())[first.name].ending == "failed"
            assert failures(first.folder) == times
        heard = Heard()
        outcomes = run_tasks(list(tasks.values()), Stop(), heard)
        assert heard.told == run_one_after_another(*NAMES[1:], NAMES[0])
        assert {outcome.ending for outcome in outcomes.values()} == {"failed"}
        assert [failures(task.folder) for task in tasks.values()] == [3, 1, 1, 1]
        engine("")
        outcomes = run_tasks(list(tasks.values()), Stop())
        assert outcomes == dict.fromkeys(NAMES, Outcome("done"))

    def test_a_failure_stops_no_other_and_has_its_reason(self, tasks, engine):
        first, *others = tasks.values()
        first.folder.mkdir(parents=True)
        (first.folder / "thesis.txt").write_text("all I have")
        outcomes = run_tasks(list(tasks.values()), Stop())
        assert outcomes[first.name].ending == "failed"
        assert "holds files but no run" in outcomes[first.name].reason
        assert all(outcomes[task.name] == Outcome("done") for task in others)

    def test_a_wish_to_stop_ends_all_of_it(self, tasks, engine):
        first, second, *_ = tasks.values()
        engine("error")
        run_tasks([second], Stop())
        engine("")
        stop = Stop()

        class Asks(Heard):
            def on_end(self, task, outcome):
                super().on_end(task, outcome)
                stop.ask()

        heard = Asks()
        assert run_tasks(list(tasks.values()), stop, heard) == {first.name: Outcome("done")}
        assert heard.told == run_one_after_another(first.name)
        assert RunDirectory(second.folder).read_state()["state"] == "failed"


def test_processor_time_or_all_cores_by_the_clock():
    assert core_s({"cpu_s": 3.0, "wall_s": 5.0, "ranks": 2}) == 3.0
    assert core_s({"cpu_s": None, "wall_s": 5.0, "ranks": 2}) == 10.0
    assert core_s({"wall_s": 5.0, "ranks": 1}) == 5.0
