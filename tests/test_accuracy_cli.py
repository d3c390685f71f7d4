"""Accuracy on the command line: the key, ``--tolerance``, and sweeps."""

from __future__ import annotations

import json
import sys

import pytest
from accuracy_studies import put, study_of
from small_scenes import COLLISION, INFILTRATION, changed, scene_of

from liggghts_driver.accuracy import accuracy_facts
from liggghts_driver.cli import main
from liggghts_driver.errors import SweepError
from liggghts_driver.identity import scene_hash
from liggghts_driver.sweeps.plan import make_plan, read_plan, write_plan

SCENE = scene_of(INFILTRATION)


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    """A working folder with the small infiltration and a study of it."""
    monkeypatch.chdir(tmp_path)
    put(study_of(SCENE), tmp_path / "runs/study/accuracy.json")
    put(INFILTRATION, tmp_path / "scene.json")
    put(changed(INFILTRATION, {"accuracy": "draft"}), tmp_path / "draft.json")
    return tmp_path


@pytest.fixture
def cli(monkeypatch, capsys):
    """Exit code and what was printed."""

    def run(*arguments: str) -> tuple[int, str]:
        monkeypatch.setattr(sys, "argv", ["liggghts-driver", *arguments])
        capsys.readouterr()
        code = 0
        try:
            main()
        except SystemExit as ended:
            code = int(ended.code or 0)
        return code, capsys.readouterr().out

    return run


def told(cli, *arguments: str) -> dict:
    return json.loads(cli(*arguments, "--json")[1])["accuracy"]


class TestTolerance:
    @pytest.mark.parametrize("command", ["run", "explain"])
    def test_it_is_the_accuracy_and_wins_over_the_scenes(self, cli, engine, command):
        for scene in ("scene.json", "draft.json"):
            facts = told(cli, command, scene, "--tolerance", "0.05")
            assert (facts["level"], facts["tolerance"]) == (None, 0.05)
            assert facts["settings"]["time.step_fraction"] == 0.2
            assert facts["settings"]["contact.stiffness_scale"] == 1.0
        assert told(cli, command, "draft.json")["level"] == "draft"
        both = ["--set", "accuracy=reference", "--tolerance", "0.05"]
        assert told(cli, command, "draft.json", *both)["tolerance"] == 0.05

    def test_people_are_told_too(self, cli, engine):
        for command in ("run", "explain"):
            text = " ".join(cli(command, "scene.json", "--tolerance", "0.05")[1].split())
            assert "accuracy 0.05: step_fraction 0.2: flow within 3.1 % (95 %)" in text
            assert "settings: time.step_fraction = 0.2, drag.tolerance = 0.001, contact.s" in text
            assert "accuracy" not in cli(command, "scene.json")[1]

    @pytest.mark.parametrize("tolerance", ["0", "1", "-0.1", "nan", "inf", "1e300"])
    def test_what_is_none(self, cli, tolerance):
        code, out = cli("explain", "scene.json", f"--tolerance={tolerance}", "--json")
        assert code == 2
        assert "above 0 and below 1" in json.loads(out)["message"]

    def test_small_ones(self, cli):
        assert told(cli, "explain", "scene.json", "--tolerance", "1e-7")["tolerance"] == 1e-7

    def test_the_missing_command(self, cli, place):
        (place / "runs/study/accuracy.json").unlink()
        code, out = cli("run", "scene.json", "--tolerance", "0.05", "--set", "seed=2", "--json")
        assert code == 2
        message = json.loads(out)["message"]
        assert "run `liggghts-driver study accuracy scene.json --set seed=2` first" in message


@pytest.mark.parametrize("command", ["deck", "estimate"])
def test_every_command_needs_the_study(cli, place, command):
    out = ["--out", "made"] if command == "deck" else []
    assert cli(command, "draft.json", *out)[0] == 0
    (place / "runs/study/accuracy.json").unlink()
    assert cli(command, "draft.json", *out)[0] == 2


def test_a_study_of_accuracy_does_not_ask_for_itself(cli, place):
    """What it refuses here is a scene without a specimen, after having read it."""
    put(changed(COLLISION, {"accuracy": "draft"}), place / "collision.json")
    code, out = cli("study", "accuracy", "collision.json", "--json")
    assert code == 2
    assert "the study compares flow rates" in json.loads(out)["message"]


SWEEP = """
scene = "draft.json"

[[axes]]
key = "{key}"
values = {values}
"""


def sweep(place, key, values, more=""):
    path = place / "sweep.toml"
    path.write_text(more + SWEEP.format(key=key, values=values))
    return path


def mistakes_of(path, *overrides: str) -> list[str]:
    with pytest.raises(SweepError) as caught:
        make_plan(path, overrides)
    return [line.removeprefix("  - ") for line in str(caught.value).splitlines()[1:]]


class TestSweeps:
    @pytest.mark.parametrize(
        ("key", "values"), [("seed", "[1, 2]"), ("time.duration", "[1.0, 2.0]")]
    )
    def test_all_points_have_the_settings_that_a_plan_was_made_with(self, place, key, values):
        path = sweep(place, key, values)
        write_plan(make_plan(path), place / "sweep")
        (place / "runs/study/accuracy.json").unlink()
        plan = read_plan(place / "sweep")
        for point in plan.points:
            scene = plan.scene(point)
            assert point.run == scene_hash(scene)[:16]
            assert scene.contact.stiffness_scale == 0.1
            assert accuracy_facts(scene)["expected_reach"] == pytest.approx(0.08)

    def test_a_setting_may_vary_and_is_explicit(self, place):
        plan = make_plan(sweep(place, "time.step_fraction", "[0.1, 0.2]"))
        facts = [accuracy_facts(plan.scene(point)) for point in plan.points]
        assert [each["overruled"] for each in facts] == [["time.step_fraction"], []]
        assert [each["expected_error"] for each in facts] == [None, 0.03]

    def test_what_makes_another_problem_may_not(self, place):
        (mistake,) = mistakes_of(sweep(place, "pressure.gradient", "[5.0, 10.0]"))
        assert mistake.startswith("accuracy = 'pressure.gradient': the errors of its settings are")
        assert "remove that axis, or give settings instead" in mistake

    def test_but_for_the_reference(self, place):
        path = sweep(place, "pressure.gradient", "[5.0, 10.0]")
        plan = make_plan(path, ["accuracy=reference"])
        assert {plan.scene(point).time.step_fraction for point in plan.points} == {0.05}

    def test_resources_are_no_problem(self, place):
        assert len(make_plan(sweep(place, "resources.ranks", "[1, 2]")).points) == 2

    def test_a_missing_study_and_a_wrong_axis_in_one_message(self, place):
        (place / "runs/study/accuracy.json").unlink()
        path = sweep(place, "pressure.gradient", "[5.0]", "[set]\nseed = 3\n")
        # A table before the scene's name would take it in.
        path.write_text(path.read_text().replace("[set]\nseed = 3\n", "") + "[set]\nseed = 3\n")
        wrong, missing = mistakes_of(path)
        assert "'pressure.gradient'" in wrong
        assert f"study accuracy {place / 'draft.json'} --set seed=3`" in missing

    def test_the_scene_must_be_whole_without_the_axes(self, place):
        put(
            changed(INFILTRATION, {"accuracy": "draft", "contact.friction": -1.0}),
            place / "draft.json",
        )
        (mistake,) = mistakes_of(sweep(place, "seed", "[1, 2]"))
        assert mistake.startswith("the scene without its axes: contact.friction = -1")

    def test_the_accuracy_itself_is_no_axis(self, place):
        mistakes = mistakes_of(sweep(place, "accuracy", '["draft", "standard"]').rename("s.toml"))
        assert any(
            m.startswith("axes[0] = 'accuracy': is the same for all points") for m in mistakes
        )
