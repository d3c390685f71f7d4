"""The command line as a stranger meets it: one JSON document, right exit codes, no traceback."""

from __future__ import annotations

import errno
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from small_scenes import COLLISION, INFILTRATION, changed, scene_of
from test_interruption import interrupt

from liggghts_driver import __version__
from liggghts_driver.cli import main
from liggghts_driver.cli.study import stability_folder
from liggghts_driver.errors import SceneError
from liggghts_driver.resources import cases_dir
from liggghts_driver.solve import solve

COMMANDS = ["run", "report", "deck", "estimate", "explain", "doctor", "schema", "study", "sweep"]
INFILTRATION_CASE = str(cases_dir() / "infiltration.toml")
TWO_SPHERES = str(cases_dir() / "two_spheres.toml")


class Ended:
    """How a command ended: its exit code and what it printed."""

    def __init__(self, code: int, out: str, err: str) -> None:
        self.code, self.out, self.err = code, out, err

    @property
    def document(self):
        """The one JSON document on stdout, strict: NaN and Infinity are none."""

        def refuse(name: str):
            raise ValueError(f"{name} is not JSON")

        return json.loads(self.out, parse_constant=refuse)


@pytest.fixture
def cli(monkeypatch, capsys, tmp_path):
    """Run a command in a folder of its own; whatever is not an exit is a traceback for a user."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: object) -> Ended:
        monkeypatch.setattr(sys, "argv", ["liggghts-driver", *map(str, arguments)])
        capsys.readouterr()
        code = 0
        try:
            main()
        except SystemExit as ended:
            code = ended.code or 0
        out, err = capsys.readouterr()
        assert "a mistake of liggghts-driver itself" not in err
        return Ended(int(code), out, err)

    return run


@pytest.fixture
def no_engine(monkeypatch, tmp_path):
    monkeypatch.delenv("LIGGGHTS_DRIVER_BINARY", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))


@pytest.fixture
def collision(tmp_path):
    path = tmp_path / "collision.json"
    path.write_text(json.dumps(COLLISION))
    return path


@pytest.fixture
def infiltration(tmp_path):
    path = tmp_path / "infiltration.json"
    path.write_text(json.dumps(INFILTRATION))
    return path


class TestEveryFailureIsADocument:
    """With --json there is one on the standard output, whatever goes wrong; and no traceback."""

    @pytest.mark.parametrize(
        "words",
        [
            ("run", "collision.json", "--ranks", "x"),
            ("run", "collision.json", "--no-such-option"),
            ("run",),
            ("run", "collision.json", "--tolerance", "abc"),
            ("estimate", "collision.json", "--gradient", "1", "--flow-rate", "1"),
            ("study", "paper", "--only", "nothing"),
            ("study", "accuracy", "collision.json", "--knobs", "nothing"),
            ("study", "stability", "nothing"),
            ("schema", "--markdown"),
        ],
    )
    def test_wrong_options(self, cli, collision, words):
        ended = cli(*words, "--json")
        assert (ended.code, ended.document["error"]) == (2, "UsageError")
        assert ended.document["message"] in ended.err.replace("\n", " ")

    @pytest.mark.parametrize(
        ("setting", "words"),
        [
            ("reservoir.length=1e9", "at most 10,000,000 can be placed"),
            ("particles.radius_mean=1e-7", "at most 10,000,000 can be placed"),
            ("grains.radius_mean=1e-7", "grains: at most 10,000,000"),
            ("particles.radius_mean=1", "is less than one particle"),
            ("reservoir.length=1e-9", "is less than one particle"),
            ("time.step=1e-30", "lengthen time.step"),
            ("output.samples=1000000000", "output.samples"),
            ("output.images=100000000", "output.images"),
        ],
    )
    def test_sizes_that_nobody_can_compute(self, cli, setting, words):
        extra = ("particles.radius_deviation=0", "grains.radius_deviation=0")
        sets = [word for each in (*extra, setting) for word in ("--set", each)]
        ended = cli("explain", cases_dir() / "infiltration_small.toml", *sets, "--json")
        assert ended.code == 2
        assert words in ended.document["message"]

    @pytest.mark.parametrize("option", ["--flow-rate=1e308", "--gradient=1e308:-1e308:5"])
    def test_numbers_beyond_all_numbers(self, cli, option):
        ended = cli("estimate", cases_dir() / "infiltration.toml", option, "--json")
        assert ended.code == 2
        assert "Warning" not in ended.err

    def test_a_launcher_that_is_no_command(self, cli, collision, engine, monkeypatch):
        monkeypatch.setenv("LIGGGHTS_DRIVER_LAUNCHER", '"mpirun')
        ended = cli("run", collision, "--ranks", "2", "--json")
        assert (ended.code, ended.document["error"]) == (1, "EngineNotFoundError")

    @pytest.mark.parametrize(
        ("raised", "code", "words"),
        [
            (KeyboardInterrupt(), 130, "interrupted"),
            (MemoryError("8 TB"), 1, "not enough memory: 8 TB"),
            (OSError(errno.ENOSPC, "No space left on device", "made/x"), 1, "made/x: No space"),
            (SceneError("a reason"), 2, "a reason"),
        ],
    )
    def test_what_nobody_asked_for(self, cli, collision, monkeypatch, raised, code, words):
        def fails(*_arguments):
            raise raised

        monkeypatch.setattr("liggghts_driver.explain.explain", fails)
        ended = cli("explain", collision, "--json")
        assert ended.code == code
        assert words in ended.document["message"]
        assert words in ended.err

    def test_a_mistake_of_our_own(self, collision, monkeypatch, capsys):
        """Its traceback is in a file, which the message names."""

        def fails(_scene):
            return {}["key"]

        monkeypatch.setattr("liggghts_driver.explain.explain", fails)
        monkeypatch.setattr(sys, "argv", ["liggghts-driver", "explain", str(collision), "--json"])
        with pytest.raises(SystemExit) as ended:
            main()
        assert ended.value.code == 1
        message = json.loads(capsys.readouterr().out)["message"]
        assert "KeyError: 'key'" in message
        kept = Path(message.rpartition(" ")[2])
        assert "Traceback" in kept.read_text()
        kept.unlink()

    def test_a_study_in_a_folder_of_somebody_else(self, cli, infiltration, tmp_path, engine):
        (tmp_path / "effects.csv").write_text("mine")
        ended = cli("study", "effects", infiltration, "--out", ".", "--json")
        assert (ended.code, ended.document["error"]) == (2, "RunFolderError")
        assert (tmp_path / "effects.csv").read_text() == "mine"
        assert not (tmp_path / "runs").exists()

    def test_a_part_of_a_study_has_a_folder_of_its_own(self):
        folders = [stability_folder(words) for words in ([], ["quick"], ["on_wall", "no-margin"])]
        assert [folder.name.removeprefix("study-stability") for folder in folders] == [
            "", "-quick", "-on_wall-no-margin"
        ]  # fmt: skip

    def test_a_run_that_begins_again_says_so(self, cli, collision, case, run, engine):
        engine("slow")
        interrupt(case, run)
        next(run.segments()[0].restarts.iterdir()).unlink()
        engine("")
        ended = cli("run", collision, "--out", run.path)
        assert "note: begun again from its start, since " in ended.err

    @pytest.mark.parametrize("ranks", [0, -1, 1.5])
    def test_ranks_from_python(self, ranks, tmp_path):
        with pytest.raises(SceneError, match="ranks = "):
            solve(scene_of(COLLISION), tmp_path / "run", ranks)

    def test_a_byte_order_mark(self, cli, tmp_path):
        text = Path(TWO_SPHERES).read_text(encoding="utf-8")
        (tmp_path / "marked.toml").write_text(text, encoding="utf-8-sig")
        assert cli("explain", "marked.toml").code == 0

    @pytest.mark.parametrize("columns", [40, 80])
    def test_no_number_is_cut_in_a_narrow_window(self, cli, monkeypatch, columns):
        monkeypatch.setenv("COLUMNS", str(columns))
        told = cli("estimate", INFILTRATION_CASE).out
        assert "1.859e-06" in told
        assert "0.002753" in told
        assert "\u2026" not in told

    def test_names_that_look_like_markup_stay(self, cli, collision, engine):
        for _ in range(2):
            ended = cli("run", collision, "--out", "r[/b]:bomb:")
            assert (ended.code, "r[/b]:bomb:" in ended.out) == (0, True)


class TestHelp:
    def test_version(self, cli):
        assert cli("--version").out == f"{__version__}\n"

    def test_help_names_every_command(self, cli):
        ended = cli("--help")
        assert ended.code == 0
        assert all(re.search(rf"^  {command} ", ended.out, re.MULTILINE) for command in COMMANDS)

    @pytest.mark.parametrize("command", COMMANDS)
    def test_help_of_each_command(self, cli, command):
        ended = cli(command, "--help")
        assert ended.code == 0
        assert "Usage: " in ended.out
        if command not in {"schema", "study", "sweep"}:  # the last two have commands of their own
            assert "--json" in ended.out

    def test_help_lines_are_whole_sentences(self, cli):
        lines = re.findall(r"^  [a-z]+ {2,}(.+)$", cli("--help").out, re.MULTILINE)
        assert len(lines) == len(COMMANDS)
        assert all(line.endswith(".") and "(Eqs." not in line for line in lines)

    def test_nothing_at_all_shows_the_help(self, cli):
        ended = cli()
        assert ended.code == 2
        assert "Usage: " in ended.out + ended.err


class TestUsage:
    @pytest.mark.parametrize(
        "arguments",
        [
            ["fly"],
            ["estimate"],
            ["estimate", "--no-such-option"],
            ["deck", TWO_SPHERES],
            ["run", TWO_SPHERES, "--ranks", "0"],
            ["run", TWO_SPHERES, "--ranks", "two"],
            ["estimate", INFILTRATION_CASE, "--flow-rate", "much"],
            ["estimate", INFILTRATION_CASE, "--flow-rate", "1e-5", "--gradient", "1"],
            ["estimate", INFILTRATION_CASE, "--set"],
        ],
        ids=lambda words: " ".join(words[:1] + words[2:]),
    )
    def test_a_wrong_call_ends_with_2_and_says_what_is_wrong(self, cli, arguments):
        ended = cli(*arguments)
        assert ended.code == 2
        assert ended.out == ""
        assert ended.err.strip()


#: Files that are no scene, by their names and contents; None is a folder, "" absent.
BAD_FILES = {
    "absent.toml": "",
    "folder": None,
    "binary.toml": b"\x7fELF\x00\xff\xfe",
    "broken.toml": b"[fluid\n",
    "empty.toml": b"\n",
    "list.json": b"[1]",
    "long.toml": b"seed = " + b"9" * 5000,
    "deep.toml": b"seed = " + b"[" * 100_000,
    "mistakes.toml": b"[particles]\ndensity = -1\n[time]\nduration = 'long'\n",
}


@pytest.mark.parametrize("command", ["run", "deck", "estimate", "explain"])
@pytest.mark.parametrize("name", BAD_FILES)
def test_a_bad_file_ends_with_2_and_one_message(cli, tmp_path, command, name):
    content = BAD_FILES[name]
    path = tmp_path / name
    if content is None:
        path.mkdir()
    elif content:
        path.write_bytes(content)
    out = ["--out", tmp_path / "out"] if command in {"run", "deck"} else []
    ended = cli(command, path, *out, "--json")
    assert ended.code == 2
    assert ended.document["error"] == "SceneError"
    assert name in ended.document["message"]
    assert ended.err == f"error: {ended.document['message']}\n"
    assert not (tmp_path / "out").exists()
    # Without --json stdout stays empty.
    assert cli(command, path, *out).out == ""


@pytest.mark.parametrize("command", ["run", "deck", "estimate", "explain"])
def test_bad_overrides_end_with_2_and_all_of_them_in_one_message(cli, tmp_path, command):
    out = ["--out", tmp_path / "out"] if command in {"run", "deck"} else []
    overrides = ["nonsense", "fluid.viscosity=-1", "particles.densty=3", "time.step=nan"]
    options = [word for override in overrides for word in ("--set", override)]
    ended = cli(command, INFILTRATION_CASE, *out, *options, "--json")
    assert ended.code == 2
    message = ended.document["message"]
    for words in ("'nonsense'", "fluid.viscosity = -1", "did you mean density?", "time.step = nan"):
        assert words in message


class TestEstimate:
    def test_the_papers_problem(self, cli):
        answer = cli("estimate", INFILTRATION_CASE, "--json").document
        # physics.md: the recomputed numbers, with the digits printed there.
        assert answer["effective_density_kg_m3"] == pytest.approx(2750, rel=1e-12)
        assert answer["effective_viscosity_pa_s"] == pytest.approx(1.4412e-3, rel=1e-4)
        assert answer["effective_permeability_m2"] == pytest.approx(1.786e-7, rel=5e-4)
        assert answer["particle_flow_rate_m3_s"] == pytest.approx(1.86e-6, rel=3e-3)

    @pytest.mark.parametrize(
        ("options", "gradients"),
        [
            (["--gradient", "5"], 5.0),
            (["--gradient", "1", "--gradient", "2"], [1.0, 2.0]),
            (["--gradient", "1,2 5"], [1.0, 2.0, 5.0]),
            (["--gradient", "1:20:3"], [1.0, 10.5, 20.0]),
            (["--gradient", "20:1:2", "--gradient", "7"], [20.0, 1.0, 7.0]),
            (["--gradient", "-5"], -5.0),
            (["--gradient=-5:5:3"], [-5.0, 0.0, 5.0]),
            (["--gradient", "1e1"], 10.0),
        ],
        ids=str,
    )
    def test_gradients(self, cli, options, gradients):
        answer = cli("estimate", INFILTRATION_CASE, *options, "--json").document
        assert answer["pressure_gradient_pa_m"] == gradients
        at_ten = cli("estimate", INFILTRATION_CASE, "--json").document["flow_rate_m3_s"]
        rates = answer["flow_rate_m3_s"]
        # Darcy's law: the flow rate is proportional to the gradient.
        listed = rates if isinstance(rates, list) else [rates]
        wanted = gradients if isinstance(gradients, list) else [gradients]
        assert listed == pytest.approx([at_ten * g / 10 for g in wanted], rel=1e-12)

    @pytest.mark.parametrize(
        "text", ["", " ", ",", "ten", "nan", "inf", "1:2", "1:2:1", "1:2:x", "1:2:3:4", "1:inf:3",
                 "::", "1:2:-3", "1:2:2.5", "0x10"],
    )  # fmt: skip
    def test_gradients_that_are_none(self, cli, text):
        ended = cli("estimate", INFILTRATION_CASE, f"--gradient={text}", "--json")
        assert ended.code == 2
        assert "start:stop:count" in ended.document["message"]

    @pytest.mark.parametrize(
        "text",
        [
            pytest.param("1:2:²"),
            pytest.param("1:2:1000000000"),
        ],
    )
    def test_counts_that_are_none(self, cli, text):
        ended = cli("estimate", INFILTRATION_CASE, "--gradient", text, "--json")
        assert ended.code == 2
        assert "count of at" in ended.document["message"]

    @pytest.mark.parametrize("rate", ["1e-5", "-1e-5", "0", "1e-9"])
    def test_backwards_and_forwards_again(self, cli, rate):
        back = cli("estimate", INFILTRATION_CASE, f"--flow-rate={rate}", "--json").document
        assert back["flow_rate_m3_s"] == pytest.approx(float(rate), rel=1e-12)
        gradient = back["pressure_gradient_pa_m"]
        there = cli("estimate", INFILTRATION_CASE, f"--gradient={gradient!r}", "--json").document
        assert there == back

    @pytest.mark.parametrize("rate", ["nan", "inf", "-inf"])
    def test_flow_rates_that_are_none(self, cli, rate):
        assert cli("estimate", INFILTRATION_CASE, f"--flow-rate={rate}", "--json").code == 2

    @pytest.mark.parametrize("gradient", ["1e308", "1.7e308", "-1.7e308"])
    def test_gradients_beyond_reason(self, cli, gradient):
        ended = cli("estimate", INFILTRATION_CASE, f"--gradient={gradient}", "--json")
        assert ended.code in {0, 2}
        assert ended.document
        if ended.code == 0:
            assert ended.document["valid"] is False

    def test_a_table_for_people(self, cli):
        text = cli("estimate", INFILTRATION_CASE, "--gradient", "1:20:3").out
        assert "gradient" in text
        assert "10.5" in text
        assert "warning: reynolds" in text  # at 20 Pa/m

    @pytest.mark.parametrize("option", [[], ["--gradient", "10"], ["--flow-rate", "1e-6"]])
    def test_a_scene_that_darcy_says_nothing_about(self, cli, option):
        ended = cli("estimate", TWO_SPHERES, *option, "--json")
        assert ended.code == 2
        assert "Darcy's law needs" in ended.document["message"]

    def test_the_gradient_may_come_from_the_command_line_alone(self, cli, infiltration):
        tables = changed(INFILTRATION, {})
        del tables["pressure"]
        infiltration.write_text(json.dumps(tables))
        assert cli("estimate", infiltration, "--gradient", "10").code == 0
        ended = cli("estimate", infiltration, "--json")
        assert ended.code == 2
        assert "[pressure]" in ended.document["message"]


class TestExplain:
    def test_json(self, cli, infiltration):
        facts = cli("explain", infiltration, "--json").document
        states = {effect["name"]: effect["active"] for effect in facts["effects"]}
        assert states["piston"]
        assert not states["gravity"]
        assert all(effect["why"] for effect in facts["effects"])
        steps = [bound["step_s"] for bound in facts["time_step_bounds"]]
        assert facts["time_step_s"] <= steps[0] == min(steps)
        assert facts["size"]["particles"] == 40
        assert facts["size"]["steps"] * facts["time_step_s"] == pytest.approx(1.0)

    def test_json_without_a_specimen(self, cli, collision):
        assert cli("explain", collision, "--json").document["size"]["grains"] == 0

    def test_a_table_for_people(self, cli, infiltration):
        text = cli("explain", infiltration).out
        assert "fluid drag" in text
        assert "[gravity]" in text  # not taken for markup
        assert "Eq. 21" in text
        assert "Stokes number" in text
        assert "predicted wall time" in text

    def test_what_is_weak_is_said(self, cli, infiltration):
        faint = ["--set", "gravity.acceleration=[0.0, 0.0, -1e-8]"]
        text = " ".join(cli("explain", infiltration, *faint).out.split())
        assert "gravity is weak: without it the motion would change by about 0.00" in text
        screened = cli("explain", infiltration, *faint, "--set", "effects.screen=0.01").out
        assert "gravity is weak" not in screened
        assert "too weak" in " ".join(screened.split())

    def test_what_cannot_be_placed(self, cli, infiltration):
        ended = cli("explain", infiltration, "--set", "particles.count=600", "--json")
        assert ended.code == 2
        assert ended.document["error"] == "PackingError"

    def test_a_step_above_its_bound(self, cli, infiltration):
        ended = cli("explain", infiltration, "--set", "time.step=0.01", "--json")
        assert ended.code == 2
        assert "must be at most" in ended.document["message"]


class TestDeck:
    def test_everything_is_written_and_nothing_run(self, cli, infiltration, tmp_path, no_engine):
        ended = cli("deck", infiltration, "--out", "made", "--json")
        assert ended.code == 0
        files = {path.name for path in (tmp_path / "made").iterdir() if path.is_file()}
        assert files == {
            "deck.in", "pieces.in", "control.in", "checkpoint.in",
            "particles.data", "piston.stl", "scene.json",
        }  # fmt: skip
        assert {name.split("/")[-1] for name in ended.document["files"]} == files

    def test_for_people_with_the_command_that_runs_it(self, cli, collision):
        text = cli("deck", collision, "--out", "made").out
        assert "made/deck.in" in text
        assert "stdbuf -oL liggghts -in deck.in" in text

    def test_the_command_for_several_ranks(self, cli, infiltration):
        text = cli("deck", infiltration, "--out", "made", "--ranks", "4").out
        assert "mpirun" in text
        assert "-np 4" in text

    def test_a_folder_with_anything_in_it_is_refused(self, cli, collision, tmp_path):
        (tmp_path / "made").mkdir()
        (tmp_path / "made" / "thesis.tex").write_text("precious")
        ended = cli("deck", collision, "--out", "made", "--json")
        assert ended.code == 2
        assert ended.document["error"] == "RunFolderError"
        assert [path.name for path in (tmp_path / "made").iterdir()] == ["thesis.tex"]

    @pytest.mark.parametrize("out", ["collision.json", "collision.json/made", "/proc/made"])
    def test_a_place_where_no_folder_can_be(self, cli, collision, out):
        ended = cli("deck", collision, "--out", out, "--json")
        assert ended.code == 2
        assert ended.document["error"] == "RunFolderError"

    def test_a_title_cannot_put_commands_into_a_deck(self, cli, collision, tmp_path):
        title = 'title="a\\nshell touch pwned"'
        ended = cli("deck", collision, "--out", "made", "--set", title)
        assert ended.code == 2
        assert not (tmp_path / "made").exists()


class TestRun:
    def test_a_whole_run(self, cli, collision, engine, tmp_path):
        ended = cli("run", collision, "--out", "made", "--json")
        assert ended.code == 0
        answer = ended.document
        assert answer["verdict"] == "valid"
        assert answer["reused"] is False
        assert answer["run_directory"] == "made"
        files = {path.name for path in (tmp_path / "made").iterdir()}
        assert files >= {
            "scene.json", "deck.in", "particles.data", "log.liggghts", "stdout.log", "series.csv",
            "results.json", "report.html", "dumps",
        }  # fmt: skip
        stored = json.loads((tmp_path / "made" / "results.json").read_text())
        assert {key: answer[key] for key in stored} == stored
        # Again: found finished; and from the folder alone.
        assert cli("run", collision, "--out", "made", "--json").document["reused"] is True
        again = cli("report", "made", "--json")
        assert again.code == 0
        assert again.document["verdict"] == "valid"

    def test_the_default_folder_is_named_after_the_scene(self, cli, collision, engine, tmp_path):
        ended = cli("run", collision)
        assert ended.code == 0
        (folder,) = (tmp_path / "runs").iterdir()
        assert folder.name.startswith("collision-")
        assert "verdict: valid" in ended.out
        assert str(folder.relative_to(tmp_path)) in ended.out

    def test_an_answer_that_is_not_steady_ends_with_1(self, cli, infiltration, engine):
        ended = cli("run", infiltration, "--out", "made", "--json")
        assert ended.code == 1
        assert ended.document["verdict"] == "not_steady"

    @pytest.mark.parametrize(
        ("behaviour", "words", "error"),
        [
            ("bad command", "Invalid pair style", "RunError"),
            ("error", "Atom lost", "RunUnstableError"),
            ("early", "did not reach the end", "RunError"),
            ("silent", "return code 1", "RunError"),
        ],
    )
    def test_a_failed_run_ends_with_1_and_its_folder_is_named(
        self, cli, collision, engine, behaviour, words, error
    ):
        engine(behaviour)
        ended = cli("run", collision, "--out", "made", "--json")
        assert ended.code == 1
        assert ended.document["error"] == error
        assert words in ended.document["message"]
        assert "made" in ended.document["message"]
        report = cli("report", "made", "--json")
        assert report.code == 2
        assert ("failed" in report.document["message"]) == (error == "RunError")
        assert words in report.document["message"] or "stopped" in report.document["message"]

    def test_without_an_engine(self, cli, collision, no_engine):
        ended = cli("run", collision, "--out", "made", "--json")
        assert ended.code == 1
        assert ended.document["error"] == "EngineNotFoundError"
        assert "apt-get install" in ended.document["message"]

    def test_into_the_folder_of_another_scene(self, cli, collision, engine):
        cli("run", collision, "--out", "made")
        ended = cli("run", collision, "--out", "made", "--set", "seed=9", "--json")
        assert ended.code == 2
        assert "another scene" in ended.document["message"]

    def test_into_a_place_where_no_folder_can_be(self, cli, collision, engine):
        ended = cli("run", collision, "--out", "collision.json/made", "--json")
        assert ended.code == 2
        assert ended.document["error"] == "RunFolderError"

    def test_an_interrupt_ends_with_130(self, binary, collision, tmp_path):
        environment = {
            **os.environ,
            "LIGGGHTS_DRIVER_BINARY": str(binary),
            "FAKE_ENGINE": "hang",
        }
        command = [sys.executable, "-m", "liggghts_driver", "run", str(collision), "--out", "made"]
        process = subprocess.Popen(
            command, cwd=tmp_path, env=environment, stderr=subprocess.PIPE, text=True
        )
        end = time.monotonic() + 15
        while not (tmp_path / "made" / "pids").exists():
            assert time.monotonic() < end
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)  # it hangs and will make no checkpoint
        _, err = process.communicate(timeout=15)
        assert process.returncode == 130
        assert "interrupted" in err
        assert "Traceback" not in err


class TestReport:
    @pytest.mark.parametrize("folder", ["absent", ".", "collision.json", "/etc/passwd"])
    def test_what_is_no_run(self, cli, collision, folder):
        ended = cli("report", folder, "--json")
        assert ended.code == 2
        assert "not a run directory" in ended.document["message"]

    def test_a_deck_that_was_never_run(self, cli, collision):
        cli("deck", collision, "--out", "made")
        ended = cli("report", "made", "--json")
        assert ended.code == 2
        assert "made" in ended.document["message"]

    @pytest.mark.parametrize("name", ["log.liggghts", "series.txt", "run.json"])
    def test_a_finished_run_of_which_something_is_gone(
        self, cli, collision, engine, name, tmp_path
    ):
        cli("run", collision, "--out", "made")
        (tmp_path / "made" / name).unlink()
        ended = cli("report", "made", "--json")
        assert ended.code in {1, 2}
        assert ended.document["message"]

    def test_a_finished_run_without_its_frames(self, cli, collision, engine, tmp_path):
        cli("run", collision, "--out", "made")
        for path in (tmp_path / "made" / "dumps").iterdir():
            path.unlink()
        ended = cli("report", "made", "--json")
        assert ended.code in {1, 2}
        assert ended.document["message"]

    def test_a_finished_run_of_other_particles(self, cli, collision, engine, tmp_path):
        """Its frames belong to the spheres in its folder, not to those that would be placed now."""
        cli("run", collision, "--out", "made")
        data = tmp_path / "made" / "particles.data"
        data.write_text(data.read_text().replace("0.003", "0.0029"))
        ended = cli("report", "made", "--json")
        assert ended.code == 2
        assert ended.document["error"] == "RunFolderError"


class TestDoctor:
    def test_nothing_installed(self, cli, no_engine):
        ended = cli("doctor", "--json")
        assert ended.code == 1
        findings = {finding["name"]: finding for finding in ended.document}
        assert not findings["liggghts"]["found"]
        assert "apt-get install" in findings["liggghts"]["detail"]
        text = cli("doctor").out
        assert "missing" in text
        assert "apt-get install" in text

    def test_installed(self, cli, engine):
        ended = cli("doctor", "--json")
        assert ended.code == 0
        assert {"name", "found", "needed", "detail"} <= set(ended.document[0])
        assert "3.8.0-fake" in cli("doctor").out


class TestSchema:
    def test_json(self, cli):
        schema = cli("schema").document
        assert set(schema["required"]) == {"particles", "contact", "time"}

    def test_markdown(self, cli):
        text = cli("schema", "--markdown").out
        assert "## `[fluid]`" in text
        assert "## `[[spheres]]`" in text
        assert all(
            f"| `{key}` |" in text for key in ("viscosity", "damping_ratio", "solid_fraction")
        )


def test_a_reader_that_goes_away_is_no_error_of_ours():
    command = f"{sys.executable} -m liggghts_driver schema | head -n 1"
    done = subprocess.run(command, shell=True, capture_output=True, text=True, check=False)
    assert done.stdout == "{\n"
    assert "Traceback" not in done.stderr


def test_the_package_runs_as_a_module():
    done = subprocess.run(
        [sys.executable, "-m", "liggghts_driver", "--version"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == f"{__version__}\n"


@pytest.mark.parametrize(
    ("tables", "changes"),
    [
        (COLLISION, {"particles.density": 1e300}),
        (COLLISION, {"particles.youngs_modulus": 1e-300}),
        (INFILTRATION, {"fluid.viscosity": 1e-300}),
        (INFILTRATION, {"specimen.length": 1e200}),
    ],
    ids=["density", "modulus", "viscosity", "length"],
)
def test_numbers_beyond_reason_are_refused_at_the_border(cli, tmp_path, tables, changes):
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(changed(tables, changes)))
    ended = cli("explain", path, "--json")
    assert ended.code == 2
    assert ended.document["error"] == "SceneError"
