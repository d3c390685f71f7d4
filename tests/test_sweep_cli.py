"""The commands of sweeps as a stranger meets them: what they print, write, launch and exit with."""

from __future__ import annotations

import collections
import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from small_scenes import COLLISION, INFILTRATION, changed

from liggghts_driver.cli import main
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.sweeps.plan import make_plan, read_plan

SWEEP = """
scene = "scene.json"

[resources]
retries = 0

[[axes]]
key = "contact.damping_ratio"
values = [0.1, 0.2, 0.3]
"""
#: Of the point in the middle; the stand-in can be told to fail at it alone.
MIDDLE = "damping_ratio.: 0.2"
#: More launches than any test asks for: after so many all go well, and a loop has an end.
TOO_MANY = 12


class Ended:
    """How a command ended: its exit code and what it printed."""

    def __init__(self, code: int, out: str, err: str) -> None:
        self.code, self.out, self.err = code, out, err

    @property
    def document(self):
        """The one JSON document on stdout."""
        return json.loads(self.out)


@pytest.fixture
def place(tmp_path, monkeypatch):
    """An empty folder to work in."""
    for name in [name for name in os.environ if name.startswith("SLURM_")]:
        monkeypatch.delenv(name)
    folder = tmp_path / "place"
    folder.mkdir()
    monkeypatch.chdir(folder)
    return folder


@pytest.fixture
def cli(monkeypatch, capsys, place):
    """Run a command; whatever is not an exit is a traceback for a user."""

    def run(*arguments: object) -> Ended:
        monkeypatch.setattr(sys, "argv", ["liggghts-driver", "sweep", *map(str, arguments)])
        capsys.readouterr()
        code = 0
        try:
            main()
        except SystemExit as ended:
            code = ended.code or 0
        return Ended(int(code), *capsys.readouterr())

    return run


@pytest.fixture
def file(place):
    """A sweep of three points."""
    (place / "scene.json").write_text(json.dumps(COLLISION))
    path = place / "three.toml"
    path.write_text(SWEEP)
    return path


class Launches:
    """What was launched since the last look: one line at each start and end, with its folder."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def lines(self) -> list[str]:
        return self.path.read_text().splitlines() if self.path.exists() else []

    def forget(self) -> None:
        self.path.unlink(missing_ok=True)

    def starts(self) -> list[str]:
        return [Path(line.split()[1]).name for line in self.lines() if line.startswith("start")]


@pytest.fixture
def launches(engine, binary, tmp_path, monkeypatch):
    """A stand-in that tells of its launches, and fails where ``middle`` says so."""
    path, found = tmp_path / "telling", Launches(tmp_path / "launches")
    path.write_text(
        "#!/bin/sh\n"
        f'case "$*" in *"-log none"*) exec {binary} "$@" ;; esac\n'
        f'echo "start $PWD" >> {found.path}\n'
        f"[ $(grep -c start {found.path}) -gt {TOO_MANY} ] && MIDDLE=\n"
        f"""[ -n "$MIDDLE" ] && grep -q '{MIDDLE}' scene.json && export FAKE_ENGINE="$MIDDLE"\n"""
        f'{binary} "$@"\n'
        "code=$?\n"
        f'echo "end $PWD" >> {found.path}\n'
        "exit $code\n"
    )
    path.chmod(0o755)
    monkeypatch.setenv("LIGGGHTS_DRIVER_BINARY", str(path))
    return found


@pytest.fixture
def middle(launches, monkeypatch):
    """Choose how the engine behaves at the point in the middle."""
    return lambda behaviour: monkeypatch.setenv("MIDDLE", behaviour)


def snapshot(folder: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in folder.rglob("*")}


def runs_of(place: Path) -> list[RunDirectory]:
    """The run directories of a sweep in the order of its points."""
    points = read_plan(place / "runs" / "sweep-three").points
    return [RunDirectory(place / "runs" / "points" / point.run) for point in points]


def counts(document: dict[str, object]) -> dict[str, int]:
    return {state: number for state, number in document["points"].items() if number}


def wait_for(condition, seconds: float = 20.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited too long"
        time.sleep(0.02)


@contextlib.contextmanager
def command(*words: object):
    """The command as a process of its own; it does not outlive the block."""
    process = subprocess.Popen(
        [sys.executable, "-m", "liggghts_driver", "sweep", *map(str, words)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate(timeout=10)


class TestDryRun:
    @pytest.mark.parametrize("options", [[], ["--json"]])
    def test_nothing_at_all_is_written(self, cli, place, file, launches, options):
        before = snapshot(place)
        assert cli("run", file, "--dry-run", *options).code == 0
        assert snapshot(place) == before
        assert launches.lines() == []

    def test_for_people(self, cli, file, launches):
        text = " ".join(cli("run", file, "--dry-run").out.split())
        assert "points 3, 3 runs, 3 to do" in text
        assert "contact.damping_ratio 3: 0.1, 0.2, 0.3" in text
        assert "folder runs/sweep-three" in text
        assert "GB free" in text

    def test_as_a_document(self, cli, file, launches):
        told = cli("run", file, "--dry-run", "--json", "--out", "mine").document
        assert (told["points"], told["runs"], told["to_do"]) == (3, 3, 3)
        assert told["axes"] == {"contact.damping_ratio": [0.1, 0.2, 0.3]}
        assert told["folder"] == "mine"
        assert 0 < told["core_time_dilute_s"] <= told["core_time_packed_s"]
        assert told["disk_bytes"] > 0

    def test_it_knows_what_is_done(self, cli, file, launches):
        cli("run", file)
        assert cli("run", file, "--dry-run", "--json").document["to_do"] == 0


class TestRun:
    def test_every_point_is_done(self, cli, place, file, launches):
        ended = cli("run", file)
        assert ended.code == 0
        assert re.search(r"^ +done +3$", ended.out, re.MULTILINE)
        assert read_plan(place / "runs" / "sweep-three") == make_plan(file)
        runs = runs_of(place)
        assert sorted(launches.starts()) == sorted(run.path.name for run in runs)
        ratios = [run.read_scene().contact.damping_ratio for run in runs]
        assert ratios == [0.1, 0.2, 0.3]
        assert all(run.results.exists() for run in runs)
        assert {path.name for path in (place / "runs").iterdir()} == {"sweep-three", "points"}

    def test_a_second_time_nothing_is_done(self, cli, place, file, launches):
        cli("run", file)
        before = snapshot(place)
        launches.forget()
        ended = cli("run", file)
        assert ended.code == 0
        assert "3 runs, 0 to do" in ended.out
        assert launches.lines() == []
        assert snapshot(place) == before

    def test_as_a_document(self, cli, file, launches):
        ended = cli("run", file, "--json")
        assert ended.code == 0
        told = ended.document
        assert counts(told) == {"done": 3}
        assert told["folder"] == "runs/sweep-three"
        assert (told["failures"], told["continuations"], told["failed"]) == (0, 0, [])
        assert ended.err == ""

    def test_more_points_need_no_more_than_their_own_runs(self, cli, place, file, launches):
        cli("run", file)
        launches.forget()
        file.write_text(SWEEP.replace("0.3]", "0.3, 0.4]"))
        assert cli("run", file).code == 0
        assert launches.starts() == [runs_of(place)[3].path.name]

    def test_another_sweep_finds_the_runs_of_this_one(self, cli, place, file, launches):
        cli("run", file)
        launches.forget()
        other = place / "other.toml"
        other.write_text(SWEEP.replace("[0.1, 0.2, 0.3]", "[0.2, 0.1]"))
        ended = cli("run", other, "--json")
        assert counts(ended.document) == {"done": 2}
        assert launches.lines() == []

    def test_folders_and_overrides_may_be_chosen(self, cli, place, file, launches):
        options = ["--out", "mine", "--runs", "ours", "--set", "seed=7"]
        assert cli("run", file, *options).code == 0
        assert not (place / "runs").exists()
        points = read_plan(place / "mine").points
        assert {point.seed for point in points} == {7}
        assert {path.name for path in (place / "ours").iterdir()} == {p.run for p in points}

    def test_a_folder_of_another_sweep_is_refused(self, cli, file, launches):
        cli("run", file)
        launches.forget()
        file.write_text(SWEEP.replace("0.3]", "0.4]"))
        ended = cli("run", file, "--json")
        assert ended.code == 2
        assert ended.document["error"] == "RunFolderError"
        assert "--out" in ended.document["message"]
        assert launches.lines() == []


class TestCores:
    def test_on_one_core_runs_follow_each_other(self, cli, file, launches):
        cli("run", file, "--cores", "1")
        assert [line.split()[0] for line in launches.lines()] == ["start", "end"] * 3

    def test_more_ranks_than_cores(self, cli, file, launches):
        file.write_text(SWEEP.replace("retries = 0", "retries = 0\nranks = 2"))
        ended = cli("run", file, "--cores", "1", "--json")
        assert ended.code == 2
        assert "resources.ranks = 2: must be at most 1" in ended.document["message"]
        assert launches.lines() == []

    @pytest.mark.parametrize("options", [["--cores", "0"], ["--retries", "-1"]])
    def test_numbers_that_are_none(self, cli, place, file, options):
        ended = cli("run", file, *options)
        assert ended.code == 2
        assert options[0] in ended.err
        assert not (place / "runs").exists()


#: Sweep files that are none, and words of the message.
BAD_FILES = {
    "absent": (None, "absent"),
    "broken": ("scene = [", "broken"),
    "no scene": ("title = 'x'\n", "scene"),
    "another scene": (SWEEP.replace("scene.json", "nowhere.json"), "nowhere"),
    "unknown key": (SWEEP.replace("damping_ratio", "dampnig_ratio"), "did you mean"),
    "bad value": (SWEEP.replace("0.2", "-0.2"), "contact.damping_ratio = -0.2"),
    "bad retries": (SWEEP.replace("retries = 0", "retries = -1"), "retries"),
}


@pytest.mark.parametrize("name", BAD_FILES)
@pytest.mark.parametrize("options", [[], ["--dry-run"]])
def test_a_bad_file_ends_with_2_and_one_message(cli, place, file, launches, name, options):
    text, words = BAD_FILES[name]
    path = place / f"{name}.toml"
    if text is not None:
        path.write_text(text)
    before = snapshot(place)
    ended = cli("run", path, *options, "--json")
    assert ended.code == 2
    assert ended.document["error"] == "SweepError"
    assert words in ended.document["message"]
    assert ended.err == f"error: {ended.document['message']}\n"
    assert cli("run", path, *options).out == ""
    assert snapshot(place) == before


class TestFailures:
    @pytest.mark.parametrize("behaviour", ["error", "crash"])
    def test_a_point_that_fails_stops_no_other(self, cli, place, file, middle, behaviour):
        middle(behaviour)
        ended = cli("run", file)
        assert ended.code == 1
        assert re.search(r"^ +done +2$", ended.out, re.MULTILINE)
        assert re.search(r"^ +failed +1$", ended.out, re.MULTILINE)
        name = runs_of(place)[1].path.name
        (line,) = re.findall(r"^failed: (.*)$", ended.out, re.MULTILINE)
        # What the watch made of it, where there was anything.
        point = re.escape(f"contact.damping_ratio = 0.2, seed 1 ({name}): ")
        assert re.match(f"{point}(the engine |spheres left the engine's box)", line)

    def test_as_a_document(self, cli, place, file, middle):
        middle("error")
        ended = cli("run", file, "--json")
        assert ended.code == 1
        assert counts(ended.document) == {"done": 2, "failed": 1}
        (trouble,) = ended.document["failed"]
        assert (trouble["point"], trouble["state"]) == (1, "failed")
        assert trouble["run"] == runs_of(place)[1].path.name
        assert trouble["values"] == {"contact.damping_ratio": 0.2}
        assert trouble["reason"]

    def test_what_cannot_be_placed_is_a_failure_of_that_point(self, cli, place, file, launches):
        (place / "scene.json").write_text(
            json.dumps(changed(INFILTRATION, {"particles.count": 10, "time.duration": 0.05}))
        )
        file.write_text(
            SWEEP.replace("contact.damping_ratio", "particles.count").replace(
                "0.1, 0.2, 0.3", "10, 600, 12"
            )
        )
        ended = cli("run", file, "--json")
        assert ended.code == 1
        assert counts(ended.document) == {"done": 2, "failed": 1}
        assert ended.document["failed"][0]["values"] == {"particles.count": 600}
        assert "600 spheres" in ended.document["failed"][0]["reason"]
        assert len(launches.starts()) == 2

    def test_it_is_left_alone_until_it_may_be_tried_again(self, cli, place, file, launches, middle):
        middle("crash")
        cli("run", file)
        launches.forget()
        before = snapshot(place / "runs")
        again = cli("run", file)
        assert again.code == 1
        assert "failed: contact.damping_ratio = 0.2" in again.out
        assert launches.lines() == []
        assert snapshot(place / "runs") == before
        middle("")
        assert cli("run", file, "--retries", "1").code == 0
        assert launches.starts() == [runs_of(place)[1].path.name]

    @pytest.mark.parametrize(
        "retries",
        [0, 1, pytest.param(3)],
    )
    def test_it_is_tried_as_often_as_asked(self, cli, place, file, launches, middle, retries):
        middle("crash")
        ended = cli("run", file, "--retries", retries, "--json")
        assert ended.code == 1
        launched = collections.Counter(launches.starts())
        names = [run.path.name for run in runs_of(place)]
        assert [launched[name] for name in names] == [1, 1 + retries, 1]
        assert ended.document["failures"] == 1 + retries

    def test_without_an_engine_nothing_is_tried(self, cli, place, file, launches, monkeypatch):
        with monkeypatch.context() as patch:
            patch.setenv("LIGGGHTS_DRIVER_BINARY", "/no/such/engine")
            ended = cli("run", file, "--json")
        assert ended.code == 1
        assert ended.document["error"] == "EngineNotFoundError"
        assert not (place / "runs" / "points").exists()
        assert cli("run", file).code == 0

    def test_the_file_says_how_often_when_the_command_does_not(
        self, cli, place, file, launches, middle
    ):
        middle("crash")
        file.write_text(SWEEP.replace("retries = 0", "retries = 1"))
        assert cli("run", file).code == 1
        assert launches.starts().count(runs_of(place)[1].path.name) == 2


class TestStatus:
    def test_by_file_and_by_folder(self, cli, place, file, middle):
        middle("error")
        cli("run", file)
        for options in ([], ["--json"]):
            by_file = cli("status", file, *options)
            by_folder = cli("status", place / "runs" / "sweep-three", *options)
            relative = cli("status", "runs/sweep-three", *options)
            assert by_file.code == by_folder.code == 0
            assert by_file.out == relative.out
            assert by_folder.out.replace(f"{place}/", "") == by_file.out
            assert "damping_ratio" in by_file.out
        assert counts(by_file.document) == {"done": 2, "failed": 1}

    def test_it_changes_nothing(self, cli, place, file, launches):
        cli("run", file)
        before = snapshot(place)
        launches.forget()
        cli("status", file)
        assert snapshot(place) == before
        assert launches.lines() == []

    def test_what_is_gone_waits_again(self, cli, place, file, launches):
        cli("run", file)
        runs_of(place)[2].results.unlink()
        assert counts(cli("status", file, "--json").document) == {"done": 2, "waiting": 1}

    @pytest.mark.parametrize("what", ["three.toml", "runs/sweep-three", ".", "/etc/passwd"])
    @pytest.mark.parametrize("name", ["status", "collect"])
    def test_without_a_plan(self, cli, file, name, what):
        ended = cli(name, what, "--json")
        assert ended.code == 2
        assert ended.document["error"] == "SweepError"
        assert "sweep.json" in ended.document["message"]


class TestChangedFile:
    """Status and collect go by the plan: a file that says something else by now is told of."""

    NOTE = (
        "note: {} has changed since its points were planned; `sweep run` takes in what was added\n"
    )

    @pytest.mark.parametrize("what", ["three.toml", "runs/sweep-three"])
    @pytest.mark.parametrize("name", ["status", "collect"])
    def test_it_is_told_once_on_stderr(self, cli, file, launches, name, what):
        cli("run", file)
        assert cli(name, what, "--json").err == ""
        file.write_text(SWEEP.replace("0.3]", "0.3, 0.4]"))
        ended = cli(name, what, "--json")
        assert ended.code == 0
        assert ended.err == self.NOTE.format(file)
        assert ended.document == cli(name, what, "--json").document
        assert cli("status", file, "--json").document["points"]["done"] == 3
        cli("run", file)
        assert cli(name, what, "--json").err == ""

    def test_of_a_file_that_is_gone_nothing_is_known(self, cli, file, launches):
        cli("run", file)
        file.unlink()
        ended = cli("status", "runs/sweep-three")
        assert (ended.code, ended.err) == (0, "")

    def test_nor_of_one_that_an_older_version_planned(self, cli, place, file, launches):
        cli("run", file)
        path = place / "runs" / "sweep-three" / "sweep.json"
        plan = json.loads(path.read_text())
        del plan["file"], plan["file_sha256"]
        path.write_text(json.dumps(plan))
        file.write_text(SWEEP.replace("0.3]", "0.3, 0.4]"))
        ended = cli("status", file)
        assert (ended.code, ended.err) == (0, "")


class TestCollect:
    def test_tables_and_a_page_of_what_is_done(self, cli, place, file, middle):
        middle("error")
        cli("run", file)
        ended = cli("collect", file, "--json")
        assert ended.code == 1  # one of three failed
        assert ended.document["verdicts"] == {"valid": 2}
        folder = place / "runs" / "sweep-three"
        assert Path(ended.document["page"]) == Path("runs/sweep-three/sweep.html")
        assert all(Path(name).exists() for name in ended.document["files"])
        assert (folder / "results.csv").exists()
        page = (folder / "sweep.html").read_text()
        assert all(run.path.name in page for run in runs_of(place))
        reports = [run.report.exists() for run in runs_of(place)]
        assert reports == [True, False, True]
        text = cli("collect", folder).out
        assert "verdicts: 2 valid" in text
        assert f"page: {folder}/sweep.html" in text

    def test_before_anything_is_done(self, cli, file, launches, engine):
        engine("error")
        cli("run", file)
        ended = cli("collect", file, "--json")
        assert (ended.code, ended.document["verdicts"]) == (1, {})
        assert Path(ended.document["page"]).exists()
        assert not list(Path("runs").rglob("report.html"))

    def test_all_of_them_valid(self, cli, file, engine):
        """And every command says so."""
        assert cli("run", file, "--json").document["verdicts"] == {"valid": 3}
        assert re.search(r"done +3\n +valid +3\n", cli("status", file).out)
        assert cli("collect", file).code == 0

    def test_results_that_are_not_whole_are_a_failed_point(self, cli, file, place, engine):
        cli("run", file)
        runs_of(place)[1].results.write_text('{"verdict": "valid"}')
        assert cli("collect", file).code == 1
        page = (place / "runs" / "sweep-three" / "sweep.html").read_text()
        assert "results.json is not whole" in page

    def test_values_that_are_vectors(self, cli, file):
        """Any key may vary."""
        file.write_text(
            'scene = "scene.json"\n[[axes]]\nkey = "box.walls"\nvalues = [["x-"], ["x+"]]\n'
        )
        ended = cli("run", file, "--dry-run")
        assert ended.code == 0, ended.err
        assert "2: ['x-'], ['x+']" in ended.out


class TestInterrupts:
    def test_ctrl_c_ends_with_130_and_the_same_command_goes_on(
        self, cli, place, file, launches, engine
    ):
        engine("slow")
        with command("run", file, "--cores", "1") as process:
            # The first is done and the second at work.
            wait_for(lambda: len(launches.starts()) == 2)
            second = runs_of(place)[1]
            wait_for(lambda: second.log.exists() and "Loop time" in second.log.read_text())
            process.send_signal(signal.SIGINT)
            out, err = process.communicate(timeout=20)
        assert process.returncode == 130
        assert "interrupted; the same command goes on from there" in err
        assert "Traceback" not in err
        assert "interrupted" in out
        assert counts(cli("status", file, "--json").document) == {
            "done": 1, "interrupted": 1, "waiting": 1
        }  # fmt: skip
        assert not runs_of(place)[2].path.exists()
        engine("")
        ended = cli("run", file, "--cores", "1", "--json")
        assert ended.code == 0
        assert counts(ended.document) == {"done": 3}
        assert (ended.document["failures"], ended.document["continuations"]) == (0, 1)
        launched = collections.Counter(launches.starts())
        # The second went on from its checkpoint.
        assert [launched[run.path.name] for run in runs_of(place)] == [1, 2, 1]
        assert not list(place.rglob("attempt-*"))

    def test_twice_ends_it_at_once(self, place, file, launches, engine):
        engine("hang")
        pids = place / "runs" / "points"
        with command("run", file, "--cores", "1") as process:
            wait_for(lambda: any(path.read_text() for path in pids.glob("*/pids")))
            run = RunDirectory(next(pids.glob("*/pids")).parent)
            process.send_signal(signal.SIGINT)
            wait_for(lambda: run.control.read_text() == run.checkpoint_commands.read_text())
            process.send_signal(signal.SIGINT)
            _, err = process.communicate(timeout=20)  # of 60 s that it would have waited
        assert process.returncode == 130
        assert "Traceback" not in err
        engine_and_child = (run.path / "pids").read_text().split()
        wait_for(lambda: not any(Path(f"/proc/{pid}").exists() for pid in engine_and_child), 2.0)

    def test_two_at_once_launch_each_run_once(self, cli, place, file, launches, engine):
        engine("slow")
        file.write_text(SWEEP.replace("0.3]", "0.3, 0.4]"))
        with command("run", file, "--json") as one, command("run", file, "--json") as other:
            printed = [process.communicate(timeout=60) for process in (one, other)]
        for process, (out, err) in zip((one, other), printed, strict=True):
            # 1 where it ended while the other was still at work on something.
            assert process.returncode in {0, 1}, err
            assert json.loads(out)["failed"] == []
        assert sorted(launches.starts()) == sorted(run.path.name for run in runs_of(place))
        ended = cli("run", file, "--json")
        assert ended.code == 0
        assert counts(ended.document) == {"done": 4}
        assert (ended.document["failures"], ended.document["continuations"]) == (0, 0)
        assert len(launches.starts()) == 4


class TestWork:
    """What a batch script calls for one task of its array."""

    @pytest.fixture
    def work(self, cli, place, file):
        """The plan is there, and a list of two tasks."""
        from liggghts_driver.sweeps.plan import write_plan

        folder = place / "runs" / "sweep-three"
        write_plan(make_plan(file), folder)
        (place / "list").write_text("2 0\n1\n")
        return ["work", folder, "--list", place / "list", "--task"]

    def test_it_is_not_for_people(self, cli):
        ended = cli("--help")
        assert "status" in ended.out
        assert not re.search(r"^ +work\b", ended.out, re.MULTILINE)

    def test_it_does_the_points_of_its_line(self, cli, place, work, launches):
        ended = cli(*work, 0)
        assert ended.code == 0
        lines = [f"contact.damping_ratio = {value}, seed 1: done" for value in (0.3, 0.1)]
        assert ended.out.splitlines() == lines
        first, second, third = (run.path.name for run in runs_of(place))
        assert launches.starts() == [third, first]
        assert cli(*work, 1).code == 0
        assert launches.starts() == [third, first, second]

    def test_a_failure_stops_no_other_and_ends_with_1(self, cli, place, work, middle, launches):
        middle("error")
        (place / "list").write_text("1 0\n")
        ended = cli(*work, 0)
        assert ended.code == 1
        first, last = ended.out.splitlines()
        assert first.startswith(
            "contact.damping_ratio = 0.2, seed 1: failed spheres left the engine's box"
        )
        assert last == "contact.damping_ratio = 0.1, seed 1: done"

    @pytest.mark.parametrize("name", ["SIGUSR1", "SIGTERM"])
    def test_a_signal_ends_it_at_a_checkpoint(
        self, cli, place, work, launches, engine, monkeypatch, name
    ):
        """SIGUSR1: its time is up, and it asks for another turn."""
        scontrol = place / "bin" / "scontrol"
        scontrol.parent.mkdir()
        scontrol.write_text(f'#!/bin/sh\necho "$*" >> {place}/asked\n')
        scontrol.chmod(0o755)
        monkeypatch.setenv("PATH", f"{scontrol.parent}:{os.environ['PATH']}")
        monkeypatch.setenv("SLURM_JOB_ID", "15")
        monkeypatch.setenv("SLURM_ARRAY_JOB_ID", "12")
        monkeypatch.setenv("SLURM_ARRAY_TASK_ID", "0")
        engine("slow")
        with command(*work, 0) as process:
            third = runs_of(place)[2]
            wait_for(lambda: third.log.exists() and "Loop time" in third.log.read_text())
            process.send_signal(signal.Signals[name])
            out, err = process.communicate(timeout=20)
        assert (process.returncode, err) == (130, "")
        assert out.startswith("contact.damping_ratio = 0.3, seed 1: interrupted ")
        assert len(out.splitlines()) == 1
        asked = place / "asked"
        assert asked.exists() == (name == "SIGUSR1")
        if asked.exists():
            assert asked.read_text() == "requeue 12_0\n"
        # Its turn again.
        engine("")
        assert cli(*work, 0).code == 0
        assert collections.Counter(launches.starts()) == {
            third.path.name: 2,
            runs_of(place)[0].path.name: 1,
        }
        assert third.read_state()["continuations"] == 1
