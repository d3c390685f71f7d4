"""Slurm does here what it does on a real cluster, and arrays of points go through it."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from liggghts_driver.sweeps.model import SlurmSettings
from liggghts_driver.sweeps.plan import Plan, Point
from liggghts_driver.sweeps.slurm import (
    SlurmError,
    cancel,
    points_in_queue,
    queue,
    submit,
    task_alive,
    task_state,
)

from .slurm import NODES, Cluster, ClusterError, wait_until

#: Starts take a second, a requeue ten (the credential of the job must expire first) and the death
#: of a node twenty; this leaves room for a machine that is busy.
TIMEOUT_S = 90.0

#: Tells what it is told, then sleeps as its first argument says. Tells each signal; ends by TERM.
WORKER = """#!/bin/sh
say() { echo "$SLURM_ARRAY_TASK_ID $(hostname) ${SLURM_RESTART_COUNT:-0} $*" >> "$told"; }
told="$1"; nap="$2"; shift 2
trap 'say USR1' USR1
trap 'say TERM; exit 1' TERM
say start "$@"
i=0
while [ "$i" -lt "$nap" ]; do sleep 0.1; i=$((i + 1)); done
say end
"""


class Told:
    """What workers told: a line ``<task> <node> <restarts> <words>`` each."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "told"
        self.program = folder / "worker.sh"
        self.program.write_text(WORKER)
        self.program.chmod(0o755)

    def command(self, tenths_of_a_second: int) -> list[str]:
        """The worker that takes so long."""
        return [str(self.program), str(self.path), str(tenths_of_a_second)]

    def lines(self, word: str) -> list[list[str]]:
        """Split lines with a word in them, in the order of tasks."""
        text = self.path.read_text() if self.path.exists() else ""
        return sorted(line.split() for line in text.splitlines() if word in line.split())

    def wait(self, word: str, count: int) -> None:
        """Wait until so many have told it."""
        wait_until(lambda: len(self.lines(word)) >= count, TIMEOUT_S, f"{count} of {word}")


@pytest.fixture
def told(tmp_path: Path) -> Told:
    return Told(tmp_path)


def sbatch(cluster: Cluster, told: Told, tenths: int, *options: str) -> str:
    """Submit a worker as it is; the job id."""
    script = told.path.with_name("script.sh")
    script.write_text(f"#!/bin/sh\nexec {shlex.join(told.command(tenths))}\n")
    always = ("--parsable", "--requeue", "--open-mode=append", f"--output={told.path}.out")
    return cluster.run("sbatch", *always, *options, str(script)).stdout.strip()


def plan(count: int, walltime_s: float | None = None, pack: int = 1, **slurm: object) -> Plan:
    points = [Point(n, f"{n:016x}", {}, 0, 1, 1, 1, walltime_s) for n in range(count)]
    settings = SlurmSettings(**slurm)
    return Plan("t", "s.toml", {}, (), tuple(points), retries=1, pack=pack, slurm=settings)


def processes_with(text: str) -> list[str]:
    """Command lines in which a text stands, of all processes of this machine."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            found.append(path.read_bytes().replace(b"\0", b" ").decode(errors="replace"))
        except (FileNotFoundError, ProcessLookupError):
            continue  # it has ended meanwhile
    return [line for line in found if text in line]


@pytest.mark.validate  # of the test's own cluster; the sweeps' tests need the same of it
def test_an_array_runs_every_task_once_on_both_nodes(cluster, told):
    sbatch(cluster, told, 10, "--array=0-3")
    told.wait("end", 4)
    assert [line[0] for line in told.lines("start")] == ["0", "1", "2", "3"]
    assert {line[1] for line in told.lines("start")} == set(NODES)


@pytest.mark.validate  # of the test's own cluster; the sweeps' tests need the same of it
def test_a_node_that_dies_has_its_task_started_again_on_the_other(cluster, told):
    job = int(sbatch(cluster, told, 600, "--array=5"))
    told.wait("start", 1)
    first = told.lines("start")[0][1]
    cluster.kill_node(first)
    assert task_state(job, 5) == "RUNNING"  # nobody knows yet
    told.wait("start", 2)
    ((_, again, restarts, _),) = told.lines("start")[1:]
    assert (again, restarts) == (next(node for node in NODES if node != first), "1")
    assert not told.lines("TERM")
    assert "DOWN" in cluster.node_state(first)
    cluster.start_node(first)
    assert cluster.node_state(first) == "IDLE"


@pytest.mark.validate  # of the test's own cluster; the sweeps' tests need the same of it
def test_the_high_partition_preempts_the_low_which_starts_again(cluster, told):
    sbatch(cluster, told, 600, "--partition=low", "--ntasks=4", "--array=0")
    told.wait("start", 1)
    cluster.run(
        *("sbatch", "--partition=high", "--ntasks=4", "--output=/dev/null", "--wrap", "sleep 1")
    )
    told.wait("start", 2)
    assert len(told.lines("TERM")) == 1
    assert [line[2] for line in told.lines("start")] == ["0", "1"]


@pytest.mark.validate  # of the test's own cluster; the sweeps' tests need the same of it
def test_a_task_is_requeued_by_its_array_and_number_alone(cluster, told):
    """By the id of its own job it is not: the last task of an array has that of the array."""
    job = sbatch(cluster, told, 600, "--array=0-2")
    told.wait("start", 3)
    cluster.run("scontrol", "requeue", f"{job}_2")
    told.wait("start", 4)
    assert [line[0] for line in told.lines("TERM")] == ["2"]
    assert [line[2] for line in told.lines("start")] == ["0", "0", "0", "1"]


def test_a_cluster_that_stops_leaves_nothing_behind(told, cluster):
    """Not even what left its job's session and is deaf to signals."""
    mark = f"86400.{abs(hash(told.path)) % 10**9}"
    with Cluster() as other:
        folder = other.folder
        deaf = f"setsid nohup sh -c \"trap '' TERM; sleep {mark}\" & wait"
        other.run("sbatch", "--output=/dev/null", "--wrap", deaf)
        wait_until(lambda: len(processes_with(mark)) >= 2, TIMEOUT_S, "the job runs")
    assert not folder.exists()
    assert not processes_with(mark)
    assert not processes_with(str(folder))


def test_a_cluster_that_does_not_start_says_why_and_leaves_nothing_behind(cluster):
    broken = Cluster({"SelectType": "select/none_such"})
    with pytest.raises(ClusterError) as caught:
        broken.start(timeout_s=1.0)
    assert "none_such" in "".join(caught.value.__notes__)
    assert not broken.folder.exists()
    assert not processes_with(str(broken.folder))


@pytest.mark.engine
def test_mpirun_reaches_both_nodes_from_a_worker(cluster, tmp_path):
    script = tmp_path / "script.sh"
    environment = "env OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1"
    launch = "setpriv --pdeathsig KILL mpirun --bind-to none -np 2 hostname"
    script.write_text(f"#!/bin/sh\nexec {environment} {launch}\n")
    out = tmp_path / "out"
    cluster.run("sbatch", "--nodes=2", "--ntasks=2", f"--output={out}", str(script))
    wait_until(lambda: out.exists() and out.read_text().count("\n") >= 2, TIMEOUT_S, "both ranks")
    assert sorted(out.read_text().split()) == list(NODES)


@pytest.mark.parametrize("name", ["plain", "a b%j 'x' \"$HOME\""])
def test_more_points_than_one_array_holds_all_run(narrow, told, tmp_path, monkeypatch, name):
    monkeypatch.setenv("SLURM_CONF", narrow.environment()["SLURM_CONF"])
    here = tmp_path / "here with blank"
    here.mkdir()
    monkeypatch.chdir(here)
    folder = Path(name)
    made = submit(plan(8, walltime_s=600.0), range(8), folder, told.command(0))
    assert [each.tasks for each in made] == [3, 3, 2]
    told.wait("end", 8)
    wait_until(lambda: not points_in_queue(folder), TIMEOUT_S, "nothing in the queue")
    starts = [" ".join(line[3:]) for line in told.lines("start")]
    jobs = here / folder / "jobs"
    expected = [
        f"start --list {jobs}/{n}.points --task {task}"
        for n, tasks in ((1, 3), (2, 3), (3, 2))
        for task in range(tasks)
    ]
    assert sorted(starts) == sorted(expected)
    assert "".join((jobs / f"{n}.points").read_text() for n in (1, 2, 3)).split() == [*"01234567"]
    outputs = {path.name for path in jobs.glob("*.out")}
    assert outputs == {
        f"{n}.{task}.out" for n, tasks in ((1, 3), (2, 3), (3, 2)) for task in range(tasks)
    }


def test_the_limit_is_exactly_the_one_of_the_cluster(narrow):
    narrow.run("sbatch", "--array=0-2", "--output=/dev/null", "--wrap", "true")
    with pytest.raises(ClusterError, match="Invalid job array specification"):
        narrow.run("sbatch", "--array=0-3", "--output=/dev/null", "--wrap", "true")


def test_points_are_followed_and_cancelled(cluster, told, tmp_path):
    """Four cores: two tasks wait. What has been cancelled is not in the queue any more."""
    made = submit(plan(12, pack=2), range(12), tmp_path, told.command(600))
    told.wait("start", 4)
    found = points_in_queue(tmp_path)
    (job,) = {each.job_id for each in made}
    assert found == {n: (f"{job}_{n // 2}", "RUNNING" if n < 8 else "PENDING") for n in range(12)}
    assert task_alive(job, 5)
    assert not task_alive(job, 6)
    cluster.run("scontrol", "hold", f"{job}_5")
    assert task_state(job, 5) == "PENDING"
    assert cancel(tmp_path)
    told.wait("TERM", 4)
    wait_until(lambda: not queue(made), TIMEOUT_S, "nothing in the queue")
    assert not task_alive(job, 0)
    assert cancel(tmp_path) == []
    assert not told.lines("end")


def test_the_warning_reaches_the_worker_which_is_the_batch_process(cluster, told, tmp_path):
    """As at the end of a time limit, for which nobody wants to wait: to that process alone."""
    (made,) = submit(plan(1, walltime_s=600.0), [0], tmp_path, told.command(600))
    told.wait("start", 1)
    shown = cluster.run("scontrol", "show", "job", f"{made.job_id}_0").stdout
    assert re.search(r"Requeue=1 .*TimeLimit=00:10:00 ", shown, re.DOTALL)
    cluster.run("scancel", "--batch", "--signal=USR1", f"{made.job_id}_0")
    told.wait("USR1", 1)
    assert task_state(made.job_id, 0) == "RUNNING"
    cancel(tmp_path)


def test_a_site_s_own_template_and_settings_are_used(cluster, told, tmp_path):
    template = tmp_path / "site.sh.j2"
    template.write_text(
        "#!/bin/bash\n# for our cluster\n{{ directives }}\n#SBATCH --comment=ours\n"
        "export PATH\nexec {{ command }}\n"
    )
    slurm = {"template": str(template), "partition": "low", "options": ("--comment=x", "--nice=5")}
    (made,) = submit(plan(1, **slurm), [0], tmp_path, told.command(50))
    told.wait("start", 1)
    shown = cluster.run("scontrol", "show", "job", f"{made.job_id}_0").stdout
    for words in ("Partition=low", "Comment=ours", "Nice=5", "ArrayTaskId=0"):
        assert words in shown
    cancel(tmp_path)


def test_a_refusal_of_slurm_is_told_in_its_words(cluster, told, tmp_path):
    with pytest.raises(
        SlurmError, match=r"invalid partition specified: none_such(.|\n)*MaxJobCount"
    ):
        submit(plan(1, partition="none_such"), [0], tmp_path, told.command(0))
    assert points_in_queue(tmp_path) == {}


def test_a_cluster_out_of_reach_is_not_an_empty_queue(cluster, told, tmp_path):
    made = submit(plan(1), [0], tmp_path, told.command(0))
    cluster.kill_controller()
    with pytest.raises(SlurmError, match="Unable to contact slurm controller"):
        task_alive(made[0].job_id, 0)
