"""What is broken on purpose, without an engine: the ways to break a case, and how they are told."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from liggghts_driver.cli import show_stability
from liggghts_driver.cli.app import app
from liggghts_driver.deck.build import build_deck
from liggghts_driver.prepare import prepare
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.scene import read_scene
from liggghts_driver.studies import broken as module
from liggghts_driver.studies.broken import Broken, of_failure, of_silence, plans_of, try_out
from liggghts_driver.studies.hard_cases import CASES, HardCase
from liggghts_driver.studies.invariants import Invariant
from liggghts_driver.studies.sabotage import (
    HALF,
    LONGER_STEP,
    NO_DRAG,
    NO_PISTON,
    NO_PRESSURE,
    WEAK_SERVO,
    Sabotage,
    sabotages_of,
    with_longer_step,
)
from liggghts_driver.studies.stability import Studied, Trial
from liggghts_driver.studies.stability_report import write_results

if TYPE_CHECKING:
    from pathlib import Path

    from liggghts_driver.case import Case

BEGUN = Broken("some_case", "no wall x-", "not run")
NUMBER = re.compile(r"((?<![\w.])-?[0-9.]+(?:e[-+]?\d+)?)")
SOUND = [case for case in CASES if case.expected == "holds"]


def case_of(name: str) -> Case:
    return prepare(read_scene(HardCase(name).path))


def deck_of(case: Case) -> list[str]:
    return build_deck(case, "0" * 64).files["deck.in"].splitlines()


def names(case: Case) -> list[str]:
    return [sabotage.name for sabotage in sabotages_of("any", case)]


def test_each_case_is_broken_in_the_ways_that_it_can_be():
    walls = [f"no wall {face}" for face in ("x+", "y-", "y+", "z-", "z+")]
    assert names(case_of("restitution_one")) == [LONGER_STEP]
    assert names(case_of("one_particle")) == [LONGER_STEP, "no wall z-"]
    piston = [NO_PISTON, WEAK_SERVO]
    assert names(case_of("blocked_inlet")) == [LONGER_STEP, *walls, *piston]
    assert names(case_of("reynolds_all")) == [LONGER_STEP, NO_DRAG, HALF]
    forces = [NO_DRAG, NO_PRESSURE, HALF]
    assert names(case_of("gradient_thousandfold")) == [LONGER_STEP, *walls, *piston, *forces]


def test_a_wall_left_out_is_one_line_of_the_deck():
    case = case_of("blocked_inlet")
    whole = deck_of(case)
    for sabotage in sabotages_of("any", case):
        if not sabotage.name.startswith("no wall"):
            continue
        (gone,) = [line for line in whole if line not in deck_of(sabotage.alter(case))]
        assert gone.startswith("fix ")
        assert sabotage.name[-2] + "plane" in gone


@pytest.mark.parametrize("name", ["blocked_inlet", "no_particle"])
def test_no_piston_is_one_that_nobody_touches(name: str):
    """The engine takes no servo without contacts, so they are those of an empty group."""
    case = case_of(name)
    (sabotage,) = (each for each in sabotages_of("any", case) if each.name == NO_PISTON)
    whole, broken = deck_of(case), deck_of(sabotage.alter(case))
    gone = [line for line in whole if line not in broken]
    came = [line for line in broken if line not in whole]
    words = ["piston all mesh/surface/stress/servo", "piston_contact all wall/gran"]
    for line, word in zip(gone, words, strict=True):
        assert line.split(maxsplit=1)[1].startswith(word)
    nobody = [line.replace(" all ", " nobody ", 1) for line in gone]
    assert came == ["group           nobody subtract all all", *nobody]


def test_the_argument_of_the_implicit_drag_is_another():
    case = case_of("micrometre_viscous")
    (sabotage,) = (each for each in sabotages_of("any", case) if each.name == HALF)
    lines = [line for line in deck_of(sabotage.alter(case)) if "CrankNicolson" in line]
    assert lines == ["fix             drag particles couple/cfd/force/implicit CrankNicolson 0.5"]
    # K dt / m is 1e4 there; with so small a step as in water neither argument is wrong by much.
    assert sabotage.harmless == ""
    assert sabotages_of("any", case_of("fluid_reverses"))[-1].harmless.startswith("K dt / m")


@pytest.mark.parametrize("case", SOUND, ids=lambda case: case.name)
def test_a_number_of_the_deck_is_another(case: HardCase):
    """Whatever scheme the drag has, and whether the gradient swings: one number of one line."""
    whole = prepare(read_scene(case.path))
    factors = {NO_DRAG: 0.0, NO_PRESSURE: 0.0, WEAK_SERVO: 0.3}
    for sabotage in sabotages_of("any", whole):
        if sabotage.name not in factors:
            continue
        lines = zip(deck_of(whole), deck_of(sabotage.alter(whole)), strict=True)
        ((before, after),) = [pair for pair in lines if pair[0] != pair[1]]
        words = zip(NUMBER.split(before), NUMBER.split(after), strict=True)
        changed = [(old, new) for old, new in words if old != new]
        ((old, new),) = changed
        assert float(new) == factors[sabotage.name] * float(old)


def test_an_edit_that_finds_nothing_is_a_mistake():
    walled, open_one = case_of("one_particle"), case_of("restitution_one")
    (_, sabotage) = sabotages_of("any", walled)
    with pytest.raises(AssertionError, match="0 times"):
        deck_of(sabotage.alter(open_one))


@pytest.mark.parametrize("case", SOUND, ids=lambda case: case.name)
def test_a_longer_step_leaves_the_plan_whole(case: HardCase):
    plan = prepare(read_scene(case.path)).time
    longer = with_longer_step(prepare(read_scene(case.path))).time
    assert longer.step_s == 20.0 * plan.step_s
    assert longer.sample_every % longer.refresh_every == 0
    for steps in (longer.steps, longer.frame_every, longer.image_every):
        assert steps % longer.sample_every == 0
    # As long as before, but for half a sample, which is 20 steps at least.
    duration = plan.steps * plan.step_s
    sample = longer.sample_every * longer.step_s
    assert abs(longer.steps * longer.step_s - duration) <= (0.5 + 1e-9) * sample
    assert f"timestep        {longer.step_s!r} " in "\n".join(deck_of_longer(case))


def deck_of_longer(case: HardCase) -> list[str]:
    return deck_of(with_longer_step(prepare(read_scene(case.path))))


def test_each_broken_run_has_a_folder_of_its_own(tmp_path: Path):
    scene = read_scene(HardCase("fluid_reverses").path)
    plans = list(plans_of("fluid_reverses", scene, tmp_path))
    folders = {plan.task.folder for plan in plans}
    assert len(folders | {plans[0].sound.folder}) == len(plans) + 1
    assert {folder.parent for folder in folders} == {tmp_path}
    again = list(plans_of("fluid_reverses", scene, tmp_path, lambda name: name == HALF))
    assert [plan.task.folder for plan in again] == [plans[-1].task.folder]


def test_what_was_not_run_is_not_passed_over(tmp_path: Path):
    plans = plans_of("one_particle", read_scene(HardCase("one_particle").path), tmp_path)
    found = try_out(plans, lambda _tasks: {})
    assert [each.fate for each in found] == ["not run", "not run"]
    assert all(each.hides for each in found)


def test_who_ended_a_run_is_told(tmp_path: Path):
    run = RunDirectory(tmp_path)
    assert of_failure(BEGUN, run).hides
    run.write_state(state="failed", faults=["no room"])
    assert of_failure(BEGUN, run).by == "refusal"
    run.deck.write_text("")
    run.write_state(state="failed", faults=["too fast"], diagnosis={"rule": "speed"})
    assert of_failure(BEGUN, run).by == "watch"
    run.write_state(state="failed", faults=["gone"], diagnosis={"rule": "lost"}, returncode=1)
    told = of_failure(BEGUN, run)
    assert (told.fate, told.by, told.sentence, told.hides) == ("caught", "engine", "gone", False)


def test_silence_is_judged_by_what_it_hides():
    plain = Sabotage("no wall x-", lambda case: case)
    excused = replace(plain, harmless="nothing touches", at_most=0.1)
    silent = {apart: replace(BEGUN, apart=apart) for apart in (0.0, 0.05, 0.5, math.nan)}
    assert of_silence(silent[0.0], plain).fate == "no difference"
    assert of_silence(silent[0.05], plain).hides
    assert of_silence(silent[0.05], excused).fate == "harmless"
    assert of_silence(silent[0.5], excused).hides
    assert of_silence(silent[math.nan], excused).hides


def results_of(broken: list[Broken], folder: Path) -> dict[str, object]:
    held = Studied(HardCase("one_particle"), own=Trial(1.0))
    return write_results([held], [], folder, broken)


def test_what_hides_is_written_and_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    case = "gradient_thousandfold"
    caught = replace(BEGUN, case=case, fate="caught", by="watch", sentence="fast")
    same = replace(caught, sabotage="no wall x+", fate="no difference", by="", apart=0.0)
    hidden = replace(same, sabotage=LONGER_STEP, fate="not caught", sentence="off", apart=2.0)
    results = results_of([caught, same, hidden], tmp_path)
    assert results["hidden"] == [f"{case}, {LONGER_STEP}"]
    assert results == json.loads((tmp_path / "stability.json").read_text())
    table = pd.read_csv(tmp_path / "broken.csv")
    assert table["fate"].tolist() == ["caught", "no difference", "not caught"]
    np.testing.assert_array_equal(table["apart_over_radius"], [math.nan, 0.0, 2.0])
    show_stability.stability(results, tmp_path, as_json=False)
    printed = capsys.readouterr().out.splitlines()
    assert max(map(len, printed[:-1])) <= 80
    (row,) = (line for line in printed if line.startswith(case))
    assert " ".join(row.split()) == f"{case} not caught 1 watch, 1 same – – –"
    assert f"not caught: {case}, {LONGER_STEP}: off" in printed


def test_what_breaks_first_is_a_word_or_two(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    """The table stays within 80 columns; the sentence is in the files."""
    change = Invariant("change with half the step", 0.0926, 0.05)
    own = Trial(1.0, (Invariant("free piston off a t²/2", 0.001, 0.05),))
    studied = Studied(HardCase("gradient_thousandfold"), own=own)
    studied.trials = [Trial(2.0, (change,), change.sentence)]
    results = write_results([studied], [], tmp_path)
    assert results["cases"][0]["breaks_by"] == change.sentence
    show_stability.stability(results, tmp_path, as_json=False)
    printed = capsys.readouterr().out.splitlines()
    assert max(map(len, printed[:-1])) <= 80
    words = "gradient_thousandfold free piston 0.0010 0.050 1.0 step halved"
    assert words in (" ".join(line.split()) for line in printed)


def test_why_a_case_is_refused_stands_below_the_table(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    why = "spheres[1].position = [0.0, 0.0, 0.0]: spheres[0] has the same centre"
    refused = Studied(HardCase("same_place", "refused"), own=Trial(1.0, why=why, refused=True))
    results = write_results([refused], [], tmp_path)
    show_stability.stability(results, tmp_path, as_json=False)
    printed = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert "same_place refused" in printed
    assert f"refused: same_place: {why}" in printed


def test_without_them_nothing_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    results = results_of([], tmp_path)
    assert results["hidden"] == []
    assert not (tmp_path / "broken.csv").exists()
    show_stability.stability(results, tmp_path, as_json=False)
    assert "sabotage" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("hides", "options", "code"),
    [(True, [], 1), (False, [], 0), (True, ["--no-broken"], 0)],
)
def test_what_hides_fails_the_command(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    hides: bool,
    options: list[str],
    code: int,
):
    fate = "not caught" if hides else "caught"
    monkeypatch.setattr(module, "study_broken", lambda *_args: [replace(BEGUN, fate=fate)])
    # A case that is refused needs no engine.
    words = ["study", "stability", "same_place", "--no-margin", "--out", str(tmp_path), *options]
    assert CliRunner().invoke(app, words).exit_code == code
    assert (tmp_path / "broken.csv").exists() is not bool(options)
