"""The engine found, launched, followed and ended; and what a failed run is told."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from pathlib import Path

import pytest

from liggghts_driver.engine.diagnose import culprit, failure_message
from liggghts_driver.engine.doctor import examine
from liggghts_driver.engine.find import (
    BINARY_VARIABLE,
    Engine,
    find_engine,
    launch_environment,
    require,
)
from liggghts_driver.engine.launch import launch
from liggghts_driver.errors import EngineNotFoundError
from liggghts_driver.rundir import RunDirectory

BANNER = "LIGGGHTS (Version LIGGGHTS-PUBLIC 3.8.0, compiled 2022 by buildd, git commit unknown)"


def program(folder: Path, name: str, text: str) -> Path:
    """An executable shell script."""
    path = folder / name
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return path


@pytest.fixture
def out(tmp_path):
    return tmp_path / "stdout.log"


@pytest.fixture
def no_choice(monkeypatch):
    monkeypatch.delenv(BINARY_VARIABLE, raising=False)


class TestFind:
    def test_on_the_path(self, tmp_path, monkeypatch, no_choice):
        binary = program(tmp_path, "liggghts", f"echo '{BANNER}'")
        monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
        assert find_engine() == Engine(str(binary), "LIGGGHTS-PUBLIC 3.8.0")

    def test_by_the_variable(self, tmp_path, monkeypatch):
        binary = program(tmp_path, "mine", f"echo '{BANNER}'")
        monkeypatch.setenv(BINARY_VARIABLE, str(binary))
        assert find_engine().binary == str(binary)

    def test_nowhere(self, tmp_path, monkeypatch, no_choice):
        monkeypatch.setenv("PATH", str(tmp_path))
        with pytest.raises(EngineNotFoundError, match=r"apt-get install .*liggghts"):
            find_engine()

    @pytest.mark.parametrize("chosen", ["/no/such/engine", "", "/etc/passwd", "/"])
    def test_a_variable_that_names_no_program(self, monkeypatch, chosen):
        monkeypatch.setenv(BINARY_VARIABLE, chosen)
        with pytest.raises(EngineNotFoundError, match=BINARY_VARIABLE):
            find_engine()

    def test_a_relative_path_is_made_whole(self, tmp_path, monkeypatch):
        binary = program(tmp_path, "mine", f"echo '{BANNER}'")
        monkeypatch.chdir(tmp_path)
        monkeypatch.setenv(BINARY_VARIABLE, "./mine")
        assert find_engine().binary == str(binary)

    def test_a_program_that_does_not_start(self, tmp_path, monkeypatch):
        broken = tmp_path / "broken"
        broken.write_bytes(b"\x7fELF nonsense")
        broken.chmod(0o755)
        monkeypatch.setenv(BINARY_VARIABLE, str(broken))
        with pytest.raises(EngineNotFoundError, match="does not start"):
            find_engine()

    def test_another_program(self, tmp_path, monkeypatch):
        monkeypatch.setenv(BINARY_VARIABLE, str(program(tmp_path, "other", "echo hello")))
        with pytest.raises(EngineNotFoundError, match="not LIGGGHTS"):
            find_engine()

    def test_a_program_that_prints_no_text(self, tmp_path, monkeypatch):
        monkeypatch.setenv(BINARY_VARIABLE, str(program(tmp_path, "odd", r"printf '\377\376'")))
        with pytest.raises(EngineNotFoundError):
            find_engine()


class TestCommand:
    def test_one_rank(self):
        command = Engine("/opt/lig", "3").command()
        assert [Path(word).name for word in command] == [
            "setpriv", "--pdeathsig", "KILL", "env", "--block-signal=TERM,HUP,USR1",
            "stdbuf", "-oL", "lig", "-in", "deck.in", "-log", "log.liggghts", "-echo", "both",
        ]  # fmt: skip

    def test_ranks(self, tmp_path, monkeypatch):
        program(tmp_path, "mpirun", "")
        monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
        command = Engine("/opt/lig", "3").command(3)
        assert command[5:10] == [str(tmp_path / "mpirun"), "--bind-to", "none", "-np", "3"]
        # The launcher is deaf to a batch system too; the engine is line buffered, not the launcher.
        assert command[4] == command[11] == "--block-signal=TERM,HUP,USR1"
        assert command[12].endswith("stdbuf")

    @pytest.mark.parametrize(("ranks", "missing"), [(1, "env|stdbuf"), (2, "env|mpirun")])
    def test_a_missing_launcher(self, tmp_path, monkeypatch, ranks, missing):
        monkeypatch.setenv("PATH", str(tmp_path))
        with pytest.raises(EngineNotFoundError, match=f"{missing}.*apt-get"):
            Engine("/opt/lig", "3").command(ranks)

    def test_environment(self, monkeypatch):
        before = dict(os.environ)
        environment = launch_environment()
        assert environment["OMP_NUM_THREADS"] == "1"
        assert ("OMPI_ALLOW_RUN_AS_ROOT" in environment) == (os.geteuid() == 0)
        assert dict(os.environ) == before

    def test_require(self):
        assert Path(require("stdbuf")).is_absolute()


class TestDoctor:
    def test_nothing_installed(self, tmp_path, monkeypatch, no_choice):
        monkeypatch.setenv("PATH", str(tmp_path))
        findings = examine()
        assert {finding.name for finding in findings} >= {"liggghts", "stdbuf", "mpirun"}
        assert not any(finding.found for finding in findings)
        assert all("apt-get install" in finding.detail for finding in findings)
        needed = {finding.name for finding in findings if finding.needed}
        assert needed == {"liggghts", "stdbuf", "env", "setpriv"}

    def test_all_there(self, tmp_path, monkeypatch, no_choice):
        for name in ("liggghts", "stdbuf", "env", "setpriv", "mpirun"):
            program(tmp_path, name, f"echo '{BANNER}'")
        monkeypatch.setenv("PATH", str(tmp_path))
        findings = {finding.name: finding for finding in examine()}
        assert all(finding.found for finding in findings.values())
        assert "LIGGGHTS-PUBLIC 3.8.0" in findings["liggghts"].detail

    def test_an_engine_without_the_coupling(self, tmp_path, monkeypatch, no_choice):
        text = f'case "$*" in *probe*) exit 1;; *) echo "{BANNER}";; esac'
        program(tmp_path, "liggghts", text)
        monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
        (coupling,) = [finding for finding in examine() if finding.name == "coupling for drag"]
        assert not coupling.found
        assert not coupling.needed
        assert "drag.carrier=addforce" in coupling.detail


class TestLaunch:
    def test_output_folder_and_return_code(self, tmp_path, out):
        ended = launch(["sh", "-c", "pwd; echo oops >&2; exit 7"], tmp_path, out)
        assert ended.returncode == 7
        assert ended.command == ("sh", "-c", "pwd; echo oops >&2; exit 7")
        assert out.read_text() == f"{tmp_path}\noops\n"
        assert 0 < ended.wall_s < 10
        assert 0 <= ended.cpu_s < 10

    def test_processor_time_is_of_everything_that_was_started(self, tmp_path, out):
        busy = "i=0; while [ $i -lt 100000 ]; do i=$((i+1)); done"
        ended = launch(["sh", "-c", f"(sh -c '{busy}'); sleep 0.3"], tmp_path, out)
        # The loop takes a tenth of a second or so, the sleep none.
        assert 0.01 < ended.cpu_s <= ended.wall_s

    def test_runs_side_by_side_share_no_folder_of_open_mpi(self, tmp_path, out):
        word = 'echo "$OMPI_MCA_orte_tmpdir_base"; ls -d "$OMPI_MCA_orte_tmpdir_base"'
        folders = []
        for _ in range(2):
            launch(["sh", "-c", word], tmp_path, out)
            name, found = out.read_text().split()
            assert name == found
            folders.append(Path(name))
        assert folders[0] != folders[1]
        assert not any(folder.exists() for folder in folders)
        # Several ranks, perhaps on several nodes, are their launcher's.
        launch(["sh", "-c", word.partition(";")[0]], tmp_path, out, alone=False)
        assert out.read_text() == "\n"

    def test_no_input_is_waited_for(self, tmp_path, out):
        launch(["cat"], tmp_path, out)
        assert out.read_bytes() == b""

    def test_a_signal_is_a_negative_return_code(self, tmp_path, out):
        ended = launch(["sh", "-c", "kill -SEGV $$"], tmp_path, out)
        assert ended.returncode == -signal.SIGSEGV

    def test_output_is_copied_byte_by_byte(self, tmp_path, out):
        noise = bytes(range(256)) * 100 + b"no end of line"
        (tmp_path / "noise").write_bytes(noise)
        launch(["cat", "noise"], tmp_path, out)
        assert out.read_bytes() == noise

    def test_lines_arrive_as_they_are_printed(self, tmp_path, out):
        seen: list[tuple[int, float]] = []
        text = "printf '       5        2 0 \\n'; sleep 0.3; printf '      10        2 0 \\n'"
        start = time.monotonic()
        launch(["sh", "-c", text], tmp_path, out, lambda s: seen.append((s, time.monotonic())))
        assert [step for step, _ in seen] == [5, 10]
        assert seen[1][1] - seen[0][1] > 0.2
        assert seen[0][1] - start < 0.25

    @pytest.mark.parametrize(
        ("line", "step"),
        [
            ("       0        2              0 ", 0),
            pytest.param("    1234    21715      17.251391 ", 1234),
            pytest.param("99999999    21715  1.7251391e-05 ", 99999999),
            ("    Step    Atoms            CPU ", None),
            ("Loop time of 0.25 on 1 procs for 10 steps with 2 atoms", None),
            ("Nlocal:    2 ave 2 max 2 min", None),
            ("Histogram: 1 0 0 0 0 0 0 0 0 0", None),
            ("  2 velocities", None),
            ("2 atoms in group particles", None),
            ("  1 by 1 by 1 MPI processor grid", None),
            ("  1 settings made for property/atom", None),
        ],
    )
    def test_which_lines_are_rows(self, tmp_path, out, line, step):
        (tmp_path / "text").write_text(line + "\n")
        seen: list[int] = []
        launch(["cat", "text"], tmp_path, out, seen.append)
        assert seen == ([] if step is None else [step])

    def test_blank_lines_are_read_as_quickly_as_others(self, tmp_path, out):
        (tmp_path / "text").write_bytes(b"\n" * 25_000)
        start = time.monotonic()
        launch(["cat", "text"], tmp_path, out)
        # It takes milliseconds, or seconds with a time that grows with the square.
        assert time.monotonic() - start < 1.0

    def test_a_row_is_one_line(self, tmp_path, out):
        (tmp_path / "text").write_text("5\n2\n0\n")
        seen: list[int] = []
        launch(["cat", "text"], tmp_path, out, seen.append)
        assert seen == []

    def test_rows_are_seen_wherever_the_output_is_cut(self, tmp_path, out):
        """Chunks of 64 kB end anywhere, in the middle of a row as well."""
        rows = [f"{step:8d} {2:8d} {step * 1e-5:14.8g} \n" for step in range(20_000)]
        (tmp_path / "text").write_text("".join(rows))
        seen: list[int] = []
        launch(["cat", "text"], tmp_path, out, seen.append)
        assert seen == list(range(20_000))

    def test_whatever_goes_wrong_while_following_ends_the_program(self, tmp_path, out):
        def fail(_: int) -> None:
            raise RuntimeError("in the progress bar")

        text = "echo $$ > pid; echo '0 2 0 '; sleep 300"
        with pytest.raises(RuntimeError, match="progress"):
            launch(["sh", "-c", text], tmp_path, out, fail)
        with pytest.raises(ProcessLookupError):
            os.kill(int((tmp_path / "pid").read_text()), 0)

    def test_the_callers_environment_and_folder_stay(self, tmp_path, out):
        before, here = dict(os.environ), Path.cwd()
        launch(["true"], tmp_path, out)
        assert dict(os.environ) == before
        assert Path.cwd() == here


DECK = """\
# a comment
units           si

variable        a atom "x"    # another
fix             one all nve
fix             one all nve
run             10
"""


class TestCulprit:
    def output(self, commands: int, more: str = "") -> str:
        """The echo of so many commands, with what they print in between."""
        lines, seen = [BANNER], 0
        for line in DECK.splitlines():
            seen += bool(line.strip()) and not line.startswith("#")
            if seen > commands:
                break
            lines += [line, "2 atoms in something"]
        return "\n".join([*lines, more])

    @pytest.mark.parametrize(
        ("commands", "line"), [(0, None), (1, 2), (2, 4), (3, 5), (4, 6), (5, 7)]
    )
    def test_the_last_command_echoed(self, commands, line):
        found = culprit(DECK, self.output(commands, "ERROR: bad"))
        assert found == (None if line is None else (line, DECK.splitlines()[line - 1].strip()))

    def test_the_echo_with_values_put_in_does_not_matter(self):
        assert culprit("fix a all print $(1+1)\n", "fix a all print $(1+1)\nfix a all print 2\n")

    def test_a_continued_command(self):
        deck = 'units si\nrun 10 every 5 &\n    "set a" &\n    "set b"\nprint "end"\n'
        echo = 'units si\nrun 10 every 5     "set a"     "set b"\nERROR: lost\n'
        assert culprit(deck, echo)[0] == 2


class TestMessage:
    def message(
        self, folder: Path, output: bytes | None, faults=("stopped at step 1 of 2",)
    ) -> str:
        run = RunDirectory(folder)
        run.deck.write_text(DECK)
        if output is not None:
            run.stdout.write_bytes(output)
        return failure_message(run, list(faults))

    def test_all_of_it(self, tmp_path):
        output = f"{BANNER}\nunits           si\nERROR: no such unit (a.cpp:1)\n"
        text = self.message(tmp_path, output.encode(), ["one", "two"])
        assert text.splitlines()[:3] == [
            "the run failed: one; two",
            "  the engine says: ERROR: no such unit (a.cpp:1)",
            "  at deck.in, line 2: units           si",
        ]
        assert f"everything is kept in {tmp_path} (stdout.log, log.liggghts)" in text

    def test_no_output_at_all(self, tmp_path):
        text = self.message(tmp_path, None)
        assert text.startswith("the run failed: stopped")
        assert str(tmp_path) in text
        assert "at deck.in" not in text

    def test_only_the_last_lines(self, tmp_path):
        lines = [f"line {number}" for number in range(10000)]
        text = self.message(tmp_path, "\n".join(lines).encode())
        assert "| line 9999" in text
        assert len(text.splitlines()) < 15

    def test_garbage(self, tmp_path):
        assert "stopped" in self.message(tmp_path, bytes(range(256)))

    def test_a_line_without_an_end(self, tmp_path):
        assert len(self.message(tmp_path, b"x" * 1_000_000)) < 10_000


def test_the_engine_is_never_asked_through_a_shell(tmp_path, out):
    launch(["echo", "$(whoami); `id` > x && y"], tmp_path, out)
    assert out.read_text() == "$(whoami); `id` > x && y\n"
    assert subprocess.run(["ls"], cwd=tmp_path, capture_output=True).stdout == b"stdout.log\n"
