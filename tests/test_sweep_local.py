"""A sweep on this machine: which tasks are at work at once, on which cores, and how it ends."""

from __future__ import annotations

import os
import signal
import threading
import time
from typing import TYPE_CHECKING

import pytest
from small_scenes import COLLISION, scene_of

from liggghts_driver.engine.stop import Stop
from liggghts_driver.errors import SweepError
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.sweeps.local import cores_here, run_local
from liggghts_driver.sweeps.task import Listener, Outcome, Task

if TYPE_CHECKING:
    from pathlib import Path

#: How long stand-in work takes: longer than it takes to start all that fits.
WORK_S = 0.1


def tasks_of(folder: Path, *ranks: int) -> list[Task]:
    """Tasks named by their numbers, one for each number of ranks."""

    def task(number: int, count: int) -> Task:
        scene = scene_of(COLLISION, {"seed": number + 1})
        return Task(str(number), lambda: scene, folder / str(number), count)

    return [task(number, count) for number, count in enumerate(ranks)]


class Work:
    """Stands in for the work on a task, and notes what is at work at once."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.at_work: dict[str, Task] = {}
        self.cores: dict[str, frozenset[int]] = {}
        self.started: list[str] = []
        self.most_ranks = self.most_tasks = 0
        self.shared = False
        self.retries: set[int] = set()
        self.do = lambda _task, _stop: time.sleep(WORK_S)

    def __call__(self, task, retries, stop, on_case, on_step) -> Outcome:
        cores = frozenset(os.sched_getaffinity(0))
        with self.lock:
            self.retries.add(retries)
            self.started.append(task.name)
            self.shared |= any(cores & self.cores[name] for name in self.at_work)
            self.cores[task.name] = cores
            self.at_work[task.name] = task
            self.most_tasks = max(self.most_tasks, len(self.at_work))
            self.most_ranks = max(self.most_ranks, sum(t.ranks for t in self.at_work.values()))
        try:
            return self.do(task, stop) or Outcome("done")
        finally:
            with self.lock:
                del self.at_work[task.name]


@pytest.fixture
def work(monkeypatch):
    stand_in = Work()
    monkeypatch.setattr("liggghts_driver.sweeps.local.work_on", stand_in)
    return stand_in


@pytest.fixture
def four_cores(monkeypatch):
    """Cores that this machine need not have."""
    own = threading.local()
    monkeypatch.setattr(os, "sched_setaffinity", lambda _, cores: setattr(own, "cores", cores))
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(own.cores))
    return range(4)


class Heard(Listener):
    """Notes what a listener is told."""

    def __init__(self) -> None:
        self.told: list[tuple[str, str]] = []
        self.outcomes: dict[str, Outcome] = {}
        self.steps: dict[str, list[int]] = {}
        self.ends: dict[str, int] = {}
        self.looks: set[threading.Thread] = set()

    def on_start(self, task):
        self.told.append(("start", task.name))

    def on_case(self, task, case):
        self.told.append(("case", task.name))
        self.ends[task.name] = case.time.steps

    def on_step(self, task, step):
        self.steps.setdefault(task.name, []).append(step)

    def on_end(self, task, outcome):
        self.told.append(("end", task.name))
        self.outcomes[task.name] = outcome

    def on_look(self):
        self.looks.add(threading.current_thread())


class TestCores:
    def test_on_one_core_tasks_follow_each_other(self, work, tmp_path):
        tasks, heard = tasks_of(tmp_path, 1, 1, 1), Heard()
        outcomes = run_local(tasks, Stop(), cores=cores_here()[:1], listener=heard)
        assert outcomes == heard.outcomes == dict.fromkeys("012", Outcome("done"))
        assert heard.told == [(what, name) for name in "012" for what in ("start", "end")]
        assert work.most_tasks == 1

    @pytest.mark.parametrize(
        ("ranks", "most_tasks"),
        [((1,) * 9, 4), ((2,) * 5, 2), ((1, 2) * 4, 3), ((3, 1, 2, 4, 1, 1, 2), 3)],
        ids=str,
    )
    def test_never_more_ranks_than_cores_and_never_fewer_than_fit(
        self, work, four_cores, tmp_path, ranks, most_tasks
    ):
        outcomes = run_local(tasks_of(tmp_path, *ranks), Stop(), cores=four_cores)
        assert {outcome.ending for outcome in outcomes.values()} == {"done"}
        assert len(outcomes) == len(ranks)
        assert work.most_ranks == 4
        assert work.most_tasks == most_tasks
        assert [len(work.cores[str(n)]) for n in range(len(ranks))] == list(ranks)
        assert not work.shared
        assert frozenset().union(*work.cores.values()) == set(four_cores)

    def test_no_small_task_overtakes_a_large_one(self, work, four_cores, tmp_path):
        """Else it might wait until all else is done."""
        heard = Heard()
        tasks = tasks_of(tmp_path, 1, 4, 1, 1)
        run_local(tasks, Stop(), cores=four_cores, listener=heard)
        assert heard.told[:4] == [("start", "0"), ("end", "0"), ("start", "1"), ("end", "1")]

    def test_a_task_has_real_cores_of_its_own(self, work, tmp_path):
        before = os.sched_getaffinity(0)
        run_local(tasks_of(tmp_path, *[1] * 5), Stop())
        assert not work.shared
        assert all(len(cores) == 1 for cores in work.cores.values())
        assert work.most_tasks == min(5, len(before))
        assert frozenset().union(*work.cores.values()) <= before
        assert os.sched_getaffinity(0) == before

    def test_the_engine_runs_on_the_cores_of_its_task(self, engine, binary, tmp_path, monkeypatch):
        wrapper = tmp_path / "wrapper"
        wrapper.write_text(
            "#!/bin/sh\n"
            'case "$*" in *"-log none"*) ;;\n'
            "*) grep Cpus_allowed_list /proc/self/status > cores ;; esac\n"
            f'exec {binary} "$@"\n'
        )
        wrapper.chmod(0o755)
        monkeypatch.setenv("LIGGGHTS_DRIVER_BINARY", str(wrapper))
        tasks = tasks_of(tmp_path, 1, 1)
        outcomes = run_local(tasks, Stop())
        assert set(outcomes.values()) == {Outcome("done")}
        found = [(task.folder / "cores").read_text().split()[1] for task in tasks]
        # One core has a number alone, several have commas or a minus.
        assert set(found) <= {str(core) for core in cores_here()}

    def test_more_ranks_than_cores_are_refused_before_anything_starts(self, work, tmp_path):
        tasks = tasks_of(tmp_path, 1, 3, 2)
        with pytest.raises(SweepError) as caught:
            run_local(tasks, Stop(), cores=[0, 1])
        text = str(caught.value)
        assert text.startswith("resources.ranks = 3: must be at most 2,")
        assert "--executor slurm" in text
        assert work.started == []

    def test_nothing_to_do(self, work):
        assert run_local([], Stop()) == {}

    def test_retries_are_passed_on(self, work, tmp_path):
        run_local(tasks_of(tmp_path, 1), Stop(), retries=5)
        assert work.retries == {5}


class TestFailures:
    def test_none_stops_the_others(self, work, four_cores, tmp_path):
        def do(task: Task, _stop: Stop) -> Outcome | None:
            match task.name:
                case "0":
                    return Outcome("failed", "the reason")
                case "1":
                    raise ZeroDivisionError("unexpected")
                case "2":
                    raise KeyboardInterrupt
                case "3":
                    return Outcome("busy", "another's")
            return None

        work.do = do
        heard = Heard()
        tasks = tasks_of(tmp_path, 1, 2, 4, 1, 3, 4, 1)
        outcomes = run_local(tasks, Stop(), cores=four_cores, listener=heard)
        assert outcomes == heard.outcomes
        assert outcomes["0"] == Outcome("failed", "the reason")
        assert outcomes["1"].ending == "failed"
        assert all(word in outcomes["1"].reason for word in ("ZeroDivisionError", "unexpected"))
        assert outcomes["2"].ending == "interrupted"
        assert outcomes["3"].ending == "busy"
        # Those that come later need all cores: the ones of those that failed are free again.
        assert [outcomes[name].ending for name in "456"] == ["done"] * 3

    def test_of_the_engine(self, engine, tmp_path):
        engine("error")
        tasks = tasks_of(tmp_path, 1, 1, 1)
        first = tasks[0].scene()

        def cured():
            engine("")
            return first

        tasks[2] = Task("2", cured, tmp_path / "2")
        outcomes = run_local(tasks, Stop(), cores=cores_here()[:1])
        assert [outcomes[name].ending for name in "012"] == ["failed", "failed", "done"]


class TestEnding:
    def test_what_waits_is_left_untouched(self, work, four_cores, tmp_path):
        stop = Stop()

        def do(task: Task, given: Stop) -> Outcome:
            assert given is stop
            if task.name == "4":
                stop.ask()
            while not stop.asked:
                if task.name == "0":
                    return Outcome("done")
                time.sleep(0.001)
            return Outcome("interrupted")

        work.do = do
        heard = Heard()
        outcomes = run_local(tasks_of(tmp_path, *[1] * 9), stop, cores=four_cores, listener=heard)
        assert outcomes == heard.outcomes
        assert outcomes.pop("0") == Outcome("done")
        assert outcomes == dict.fromkeys("1234", Outcome("interrupted"))
        assert sorted(work.started) == list("01234")
        assert list(tmp_path.iterdir()) == []

    def test_asked_before_it_begins_it_does_nothing(self, work, tmp_path):
        stop = Stop()
        stop.ask()
        assert run_local(tasks_of(tmp_path, 1, 1), stop) == {}
        assert work.started == []

    def test_runs_end_at_their_checkpoints_and_go_on(self, engine, tmp_path):
        engine("slow")
        stop, tasks = Stop(), tasks_of(tmp_path, 1, 1)

        class Asks(Heard):
            def on_step(self, task, step):
                super().on_step(task, step)
                if step and not stop.asked:
                    stop.ask()

        outcomes = run_local(tasks, stop, cores=cores_here()[:1], listener=Asks())
        assert {name: outcome.ending for name, outcome in outcomes.items()} == {"0": "interrupted"}
        assert not tasks[1].folder.exists()
        engine("")
        outcomes = run_local(tasks, Stop())
        assert outcomes == dict.fromkeys("01", Outcome("done"))
        states = [RunDirectory(task.folder).read_state() for task in tasks]
        assert [state["continuations"] for state in states] == [1, 0]

    @pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGUSR1])
    def test_a_signal_is_the_wish_to_end(self, work, tmp_path, number):
        stop = Stop()

        def do(_task: Task, _stop: Stop) -> Outcome:
            while not stop.asked:
                time.sleep(0.001)
            return Outcome("interrupted")

        class Sends(Listener):
            def on_look(self):
                if not stop.asked:
                    os.kill(os.getpid(), number)

        work.do = do
        before = signal.getsignal(number)
        # More tasks than any machine has cores.
        tasks = tasks_of(tmp_path, *[1] * (len(cores_here()) + 1))
        outcomes = run_local(tasks, stop, listener=Sends())
        assert set(outcomes.values()) == {Outcome("interrupted")}
        assert len(outcomes) == len(tasks) - 1
        assert stop.signal == number
        assert not stop.at_once
        assert signal.getsignal(number) == before


class TestListener:
    def test_it_hears_all_of_real_runs(self, engine, tmp_path):
        tasks, heard = tasks_of(tmp_path, 1, 1, 1), Heard()
        run_local(tasks, Stop(), listener=heard)
        for name in "012":
            mine = [what for what, of in heard.told if of == name]
            assert mine == ["start", "case", "end"]
            assert heard.steps[name][-1] == heard.ends[name]
        assert heard.looks == {threading.main_thread()}

    def test_it_hears_of_what_was_done_before(self, engine, tmp_path):
        tasks = tasks_of(tmp_path, 1)
        run_local(tasks, Stop())
        heard = Heard()
        run_local(tasks, Stop(), listener=heard)
        assert heard.told == [("start", "0"), ("end", "0")]
        assert heard.outcomes == {"0": Outcome("done", reused=True)}


def test_a_task_of_two_sweeps_runs_once(engine, tmp_path):
    engine("slow")
    tasks, first = tasks_of(tmp_path, 1), {}
    other = threading.Thread(target=lambda: first.update(run_local(tasks, Stop())))
    other.start()
    while not RunDirectory(tasks[0].folder).scene.exists():
        time.sleep(0.01)
    second = run_local(tasks, Stop())
    assert second["0"].ending == "busy"
    other.join(60)
    assert first == {"0": Outcome("done")}
    assert not list(tasks[0].folder.glob("attempt-*"))
    assert run_local(tasks, Stop()) == {"0": Outcome("done", reused=True)}
