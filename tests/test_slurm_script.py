"""Job scripts and what squeue says, without Slurm: grouping, limits, quoting, recorded lines."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import pytest

from liggghts_driver.sweeps.model import SlurmSettings
from liggghts_driver.sweeps.plan import Plan, Point
from liggghts_driver.sweeps.slurm import (
    SlurmError,
    cancel,
    group_points,
    largest_array,
    points_in_queue,
    queue,
    read_submissions,
    submit,
    task_alive,
    task_state,
)
from liggghts_driver.sweeps.slurm_queue import Submission, parse_queue, record
from liggghts_driver.sweeps.slurm_script import (
    directives,
    job_name,
    output_of,
    render_script,
    require_long_enough,
    signal_lead_s,
)

#: What squeue of Slurm 22.05 printed with -r -o '%i|%T' of an array one of whose tasks was
#: requeued and held, one suspended, one held, one running; and of a job without tasks.
RECORDED = """\
1_4|PENDING
1_6|PENDING
1_1|PENDING
1_5|PENDING
1_3|RUNNING
1_2|SUSPENDED
7|COMPLETING
"""

#: Stand-ins for Slurm's commands: they answer from files beside them, and keep what they were told.
FAKE = """#!/bin/sh
printf '%s\\n' "$0 $*" >> "{calls}"
env > "{calls}.env"
name="${{0##*/}}"
[ -f "{answers}/$name.err" ] && cat "{answers}/$name.err" >&2 && exit 1
cat "{answers}/$name"
"""


def point(index, ranks=1, nodes=1, walltime_s=None):
    return Point(index, f"{index:016x}", {}, 0, 1, ranks, nodes, walltime_s)


def plan(points, pack=1, **slurm):
    settings = SlurmSettings(**slurm)
    return Plan("t", "s.toml", {}, (), tuple(points), retries=1, pack=pack, slurm=settings)


@pytest.fixture
def fake(tmp_path, monkeypatch):
    """Slurm's commands that answer what a test says: a dictionary from their name."""
    programs, answers = tmp_path / "bin", tmp_path / "answers"
    programs.mkdir()
    answers.mkdir()
    calls = tmp_path / "calls"
    for name in ("sbatch", "squeue", "scontrol", "scancel"):
        program = programs / name
        program.write_text(FAKE.format(calls=calls, answers=answers))
        program.chmod(0o755)
        (answers / name).touch()
    (answers / "scontrol").write_text("ClusterName             = here\nMaxArraySize = 4\n")
    (answers / "sbatch").write_text("12\n")
    monkeypatch.setenv("PATH", f"{programs}{os.pathsep}{os.environ['PATH']}")

    def answer(**texts):
        for name, text in texts.items():
            command, _, error = name.partition("_")
            (answers / f"{command}.err" if error else answers / command).write_text(text)
        return calls

    return answer


def test_points_that_need_the_same_share_an_array():
    points = [point(0), point(1, ranks=4), point(2), point(3, walltime_s=600.0), point(4)]
    arrays = group_points(points, pack=2)
    assert [(a.ranks, a.nodes, a.walltime_s, a.tasks) for a in arrays] == [
        (1, 1, None, ((0, 2), (4,))),
        (4, 1, None, ((1,),)),
        (1, 1, 600.0, ((3,),)),
    ]
    assert len(group_points([point(0), point(1, ranks=2, nodes=2), point(2, ranks=2)], 1)) == 3


def test_an_array_is_no_larger_than_the_cluster_takes():
    arrays = group_points(map(point, range(11)), pack=2, largest=2)
    assert [a.tasks for a in arrays] == [((0, 1), (2, 3)), ((4, 5), (6, 7)), ((8, 9), (10,))]
    assert group_points([], pack=2, largest=2) == []


@pytest.mark.parametrize(
    ("settings", "largest"),
    [
        ({"MaxArraySize": "1001"}, 1001),
        ({"MaxArraySize": "1001", "SchedulerParameters": "a=1,max_array_tasks=50,b"}, 50),
        ({"MaxArraySize": "1001", "SchedulerParameters": "(null)"}, 1001),
    ],
)
def test_the_cluster_s_own_limits(settings, largest):
    assert largest_array(settings) == largest


def test_a_cluster_without_arrays_is_refused():
    with pytest.raises(SlurmError, match="takes no job arrays"):
        largest_array({"MaxArraySize": "0"})


SCRIPT = """\
#!/bin/sh
#SBATCH --job-name=sweep-a-b.3
#SBATCH --array=0-1
#SBATCH --ntasks=4
#SBATCH --nodes=2
#SBATCH --time=11
#SBATCH --open-mode=append
#SBATCH --requeue
#SBATCH --signal=B:USR1@60
#SBATCH --partition=short
#SBATCH --account=me
#SBATCH --qos=low
#SBATCH --exclusive
#SBATCH --mem=2G

cd '{folder}' || exit 1
# Slurm signals only the batch process itself, so the worker takes the place of this shell.
exec python -m it 'a b' --list '{folder}/jobs/3.points' --task "$SLURM_ARRAY_TASK_ID"
"""


def test_the_whole_script(tmp_path, monkeypatch):
    folder = tmp_path / "with blank"
    folder.mkdir()
    monkeypatch.chdir(folder)
    settings = SlurmSettings(
        partition="short", account="me", qos="low", options=("--exclusive", "--mem=2G")
    )
    (array,) = group_points([point(5, 4, 2, 601.0), point(6, 4, 2, 601.0)], pack=1)
    lines = directives(array, job_name(Path("runs/sweep-a b"), 3), settings)
    script = render_script(lines, ["python", "-m", "it", "a b"], folder / "jobs/3.points", None)
    assert script == SCRIPT.format(folder=folder)


def test_without_settings_no_option_stands_in_the_script():
    (array,) = group_points([point(0)], pack=1)
    text = "\n".join(directives(array, "a.1", SlurmSettings()))
    for absent in ("--time", "--partition", "--account", "--qos", "None"):
        assert absent not in text
    assert "--array=0-0" in text


@pytest.mark.parametrize("walltime_s", [1.0, 179.9])
def test_a_limit_too_short_for_a_warning_is_refused(walltime_s):
    with pytest.raises(SlurmError, match=r"walltime_s = .*at least 180 s .points with less: 1"):
        require_long_enough([point(0), point(1, walltime_s=walltime_s)])


def test_the_warning_comes_a_tenth_of_the_limit_before_its_end_within_bounds():
    require_long_enough([point(0, walltime_s=180.0)])
    limits = [180.0, 600.0, 900.0, 1200.0, 86400.0, None]
    assert [signal_lead_s(limit) for limit in limits] == [60, 60, 90, 120, 120, 120]


@pytest.mark.parametrize("name", ["a b", "it's", 'say "x"', "$HOME `id`", "50%j", "ü\\n"])
def test_any_folder_and_any_word_reach_the_worker(tmp_path, monkeypatch, name):
    """A shell runs the script: what the worker gets are the very words."""
    folder = tmp_path / name
    folder.mkdir()
    monkeypatch.chdir(folder)
    (array,) = group_points([point(0)], pack=1)
    command = ["sh", "-c", 'pwd; printf "%s\\n" "$@"', "worker", name]
    lines = directives(array, "a.1", SlurmSettings())
    script = render_script(lines, command, folder / "1.points", None)
    done = subprocess.run(
        ["sh", "-c", script],
        cwd="/",
        env={**os.environ, "SLURM_ARRAY_TASK_ID": "7"},
        capture_output=True,
        text=True,
        check=True,
    )
    told = [str(folder), name, "--list", str(folder / "1.points"), "--task", "7"]
    assert done.stdout.splitlines() == told


def test_a_percent_in_a_folder_is_no_placeholder_and_a_backslash_is_refused(tmp_path, fake):
    assert output_of(Path("/a/50%j"), 2) == "/a/50%%j/2.%a.out"
    with pytest.raises(SlurmError, match="no backslash"):
        submit(plan([point(0)]), [0], tmp_path / "a\\b", ["worker"])


def site(tmp_path, text):
    """Render with a site's own template; the script."""
    template = tmp_path / "site.sh.j2"
    template.write_text(text, encoding="utf-8")
    (array,) = group_points([point(0)], pack=1)
    lines = directives(array, "a.1", SlurmSettings())
    return render_script(lines, ["worker"], Path("/x/1.points"), str(template))


def test_a_site_s_template_stands_in_for_the_shipped(tmp_path):
    text = '#!/bin/bash -l\n# ours\n{{ directives }}\nmodule load x\na=(1)\necho "${#a[@]}"\n'
    script = site(tmp_path, text + "exec {{ command }}\n")
    assert script.startswith("#!/bin/bash -l\n# ours\n#SBATCH --job-name=a.1\n")
    assert '\nmodule load x\na=(1)\necho "${#a[@]}"\nexec worker --list /x/1.points' in script


def test_a_site_s_template_is_refused_with_every_mistake(tmp_path):
    with pytest.raises(SlurmError) as caught:
        site(tmp_path, "module load x\n{{ directives }}\n{{ command }}\n")
    lines = str(caught.value).splitlines()
    assert lines[0].endswith("site.sh.j2: no job script")
    for word, line in zip(("#!", "{{ directives }}", "exec"), lines[1:], strict=True):
        assert word in line


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("#!/bin/sh\n{{ directive }}\n", "'directive' is undefined"),
        ("#!/bin/sh\n{{ directives }}\n{% if %}\n", "line 3: TemplateSyntaxError"),
        ("#!/bin/sh\n{{ directives }} --x\nexec {{ command }}\n", "must stand alone"),
        ("#!/bin/sh\n{{ directives }}\nexec {{ command }} &\n", "line of its own"),
    ],
)
def test_a_template_that_is_wrong_is_told(tmp_path, text, words):
    with pytest.raises(SlurmError, match=words):
        site(tmp_path, text)


def test_what_squeue_printed_is_read():
    assert parse_queue(RECORDED) == {
        "1_4": "PENDING",
        "1_6": "PENDING",
        "1_1": "PENDING",
        "1_5": "PENDING",
        "1_3": "RUNNING",
        "1_2": "SUSPENDED",
        "7": "COMPLETING",
    }
    assert parse_queue("") == {}


@pytest.mark.parametrize("line", ["1_[3-6%2]|PENDING", "1_3", "1_|RUNNING", "JOBID|STATE", "1|"])
def test_anything_else_that_squeue_prints_is_refused(line):
    with pytest.raises(SlurmError, match="printed"):
        parse_queue(f"1_2|RUNNING\n{line}\n")


def test_submitting_writes_lists_scripts_and_what_was_submitted(tmp_path, fake):
    calls = fake(sbatch="12;here\n")
    folder = tmp_path / "a sweep"
    points = [*map(point, range(9)), point(9, ranks=2)]
    made = submit(plan(points, pack=2), range(10), folder, ["worker"])
    assert [each.tasks for each in made] == [4, 1, 1]
    assert (folder / "jobs/1.points").read_text() == "0 1\n2 3\n4 5\n6 7\n"
    assert (folder / "jobs/2.points").read_text() == "8\n"
    assert (folder / "jobs/3.points").read_text() == "9\n"
    assert "#SBATCH --ntasks=2\n" in (folder / "jobs/3.sh").read_text()
    assert read_submissions(folder) == made
    assert {(each.job_id, each.cluster) for each in made} == {(12, "here")}
    told = [line.split(" --", 1)[1] for line in calls.read_text().splitlines() if "sbatch" in line]
    assert told == [f"parsable --output={folder}/jobs/{n}.%a.out {n}.sh" for n in (1, 2, 3)]
    again = submit(plan(points), [9], folder, ["worker"])
    assert [each.points for each in again] == ["4.points"]
    assert read_submissions(folder) == made + again


def test_what_a_surrounding_job_or_a_user_s_taste_says_is_not_passed_on(
    tmp_path, fake, monkeypatch
):
    monkeypatch.setenv("SLURM_RESTART_COUNT", "3")
    monkeypatch.setenv("SQUEUE_STATES", "running")
    monkeypatch.setenv("SLURM_CONF", "/etc/here.conf")
    calls = fake()
    submit(plan([point(0)]), [0], tmp_path, ["worker"])
    given = Path(f"{calls}.env").read_text().splitlines()
    assert "SLURM_CONF=/etc/here.conf" in given
    assert not [line for line in given if line.startswith(("SLURM_R", "SQUEUE_"))]


def test_a_refusal_tells_the_limits_and_what_was_submitted_before(tmp_path, fake):
    fake(sbatch_error="sbatch: error: Batch job submission failed: Job violates limits\n")
    record(tmp_path, Submission(1, "0.points", 1, "", "here"))
    with pytest.raises(SlurmError) as caught:
        submit(plan([point(0)]), [0], tmp_path, ["worker"])
    for words in ("Job violates limits", "MaxArraySize = 4", "tasks = 1, ranks = 1", "none"):
        assert words in str(caught.value)
    assert len(read_submissions(tmp_path)) == 1


def test_an_sbatch_that_tells_no_job_id_is_an_error(tmp_path, fake):
    fake(sbatch="welcome\n")
    with pytest.raises(SlurmError, match="told no job id but 'welcome'"):
        submit(plan([point(0)]), [0], tmp_path, ["worker"])


def test_points_are_found_in_the_queue_by_their_lists(tmp_path, fake):
    calls = fake(squeue="12_0|RUNNING\n12_1|PENDING\n13_0|RUNNING\n", sbatch="12\n")
    submit(plan(map(point, range(5)), pack=2), range(5), tmp_path, ["worker"])
    fake(sbatch="13\n")
    submit(plan(map(point, range(5)), pack=2), [0, 3], tmp_path, ["worker"])
    assert points_in_queue(tmp_path) == {
        0: ("12_0", "RUNNING"),
        1: ("12_0", "RUNNING"),
        2: ("12_1", "PENDING"),
        3: ("13_0", "RUNNING"),
    }
    asked = [line for line in calls.read_text().splitlines() if "squeue" in line]
    assert [line.split()[-1] for line in asked] == ["12,13"]
    assert cancel(tmp_path) == ["12_0", "12_1", "13_0"]
    assert calls.read_text().splitlines()[-1].endswith("scancel 12 13")


def test_nothing_submitted_asks_nothing(tmp_path, fake):
    calls = fake()
    assert points_in_queue(tmp_path) == {}
    assert cancel(tmp_path) == []
    assert not calls.exists()


def test_a_job_that_has_ended_is_not_in_the_queue(fake):
    fake(squeue_error="slurm_load_jobs error: Invalid job id specified\n")
    assert queue([Submission(12, "1.points", 1, "", "here")]) == {}
    assert not task_alive(12, 0)


def test_a_task_that_waits_or_runs_is_alive(fake):
    for state in ("PENDING", "RUNNING", "COMPLETING"):
        calls = fake(squeue=f"{state}\n")
        assert task_alive(12, 3)
        assert task_state(12, 3) == state
    assert calls.read_text().splitlines()[-1].endswith("--jobs 12_3 --format %T")
    fake(squeue="")
    assert task_state(12) is None
    assert not task_alive(12)


def test_a_squeue_that_cannot_tell_is_an_error_in_its_own_words(fake):
    words = "Unable to contact slurm controller (connect failure)"
    fake(squeue_error=f"slurm_load_jobs error: {words}\n")
    for ask in (lambda: queue([Submission(12, "1.points", 1, "", "here")]), lambda: task_alive(1)):
        with pytest.raises(SlurmError) as caught:
            ask()
        first, hint = str(caught.value).splitlines()
        assert first == f"squeue: slurm_load_jobs error: {words}"
        assert "--executor local" in hint


def test_jobs_of_another_cluster_are_not_taken_for_ended(fake):
    fake(squeue_error="slurm_load_jobs error: Invalid job id specified\n")
    with pytest.raises(SlurmError, match="cluster there, and this is here"):
        queue([Submission(12, "1.points", 1, "", "there")])


def test_a_missing_command_is_told_with_its_package(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(SlurmError, match=r"squeue: not found .* apt-get install slurm-client"):
        task_alive(1, 0)


@pytest.mark.parametrize("text", ["[", json.dumps([{"job": 1}]), "{}x", "3"])
def test_a_spoilt_record_is_told_with_its_path(tmp_path, text):
    (tmp_path / "jobs").mkdir()
    (tmp_path / "jobs/submitted.json").write_text(text)
    with pytest.raises(SlurmError, match=r"submitted.json: cannot be read"):
        read_submissions(tmp_path)
