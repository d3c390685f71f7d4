"""The study of stability without an engine: its cases, its search for a margin, its files."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

import pandas as pd
import pytest

from liggghts_driver.resources import cases_dir
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.scene import read_scene
from liggghts_driver.studies import stability as module
from liggghts_driver.studies.hard_cases import CASES, HardCase, hard_cases
from liggghts_driver.studies.invariants import Invariant
from liggghts_driver.studies.stability import (
    Studied,
    Trial,
    judged,
    scene_at,
    study_stability,
    trial_of,
)
from liggghts_driver.studies.stability_map import Point
from liggghts_driver.studies.stability_report import write_results
from liggghts_driver.studies.tasks import task_of

if TYPE_CHECKING:
    from pathlib import Path

PAIR = HardCase("restitution_one")


def test_every_file_is_a_case_and_says_what_is_hard():
    files = {path.stem for path in (cases_dir() / "hard").glob("*.toml")}
    assert files == {case.name for case in CASES}
    for case in CASES:
        assert case.path.read_text(encoding="utf-8").startswith("# Hard: ")
        assert case.hard.endswith(".")


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_scenes_are_read_or_refused_as_they_must(case: HardCase):
    if case.expected == "refused":
        (studied,) = study_stability([case], cases_dir(), lambda _tasks: {})
        assert studied.as_expected
        assert "has the same centre" in studied.own.why
    else:
        assert read_scene(case.path).title


def test_cases_by_name():
    assert hard_cases(["one_particle"]) == [HardCase("one_particle")]
    assert all(case.quick for case in hard_cases(quick=True))
    with pytest.raises(KeyError, match="nonsense"):
        hard_cases(["nonsense"])


def tried_until(breaks: float, refused: float = math.inf) -> tuple[Studied, list[float]]:
    """The multiples that are tried of a case which breaks at one of them."""
    studied = Studied(PAIR, own=Trial(1.0))
    asked = []
    while (factor := studied.next_factor()) is not None:
        asked.append(factor)
        why = "it breaks" if factor >= breaks else ""
        studied.trials.append(Trial(factor, why=why, refused=factor >= refused))
    return studied, asked


def test_the_margin_is_searched_by_doubling_and_two_bisections():
    studied, asked = tried_until(5.3)
    assert asked == pytest.approx([2.0, 4.0, 8.0, 2.0**2.5, 2.0**2.25])
    assert studied.margin == pytest.approx(2.0**2.25)
    assert studied.breaks_at == pytest.approx(2.0**2.5)


def test_what_never_breaks_is_tried_up_to_64():
    studied, asked = tried_until(math.inf)
    assert asked == [2.0, 4.0, 8.0, 16.0, 32.0, 64.0]
    assert (studied.margin, studied.breaks_at) == (64.0, math.inf)


def test_what_breaks_by_itself_has_no_margin():
    studied = Studied(PAIR, own=Trial(1.0, why="energy without work: 2, at most 0.05"))
    assert studied.next_factor() is None
    assert not studied.as_expected
    # That there is no answer is for the driver to say, and not for this study or a full disk.
    assert not Studied(HardCase("x", "invalid"), own=studied.own).as_expected
    assert Studied(HardCase("x", "invalid"), own=Trial(1.0, why="no", invalid=True)).as_expected
    assert not Studied(HardCase("x", "refused"), own=studied.own).as_expected


def test_a_scene_with_a_larger_step_asks_for_fewer_rows():
    scene = read_scene(PAIR.path)
    step = 4e-5
    assert scene_at(scene, step, 1.0) is scene
    larger = scene_at(scene, step, 8.0)
    assert larger.time.step == 8.0 * step
    assert larger.time.step_fraction == 1.0
    assert larger.output.samples == int(scene.time.duration / (8.0 * step))
    assert scene_at(scene, step, 0.5).output == scene.output


def test_a_verdict_counts_beside_the_invariants():
    holds = [Invariant("overlap", 0.005, 0.01)]
    assert judged(1.0, holds, {"verdict": "not_steady", "reasons": ["short"]}).holds
    wrong = judged(1.0, holds, {"verdict": "invalid", "reasons": ["a particle reached 9 m/s"]})
    assert wrong.why == "a particle reached 9 m/s"
    assert wrong.invalid
    broken = judged(1.0, [Invariant("overlap", 0.05, 0.01)], {"verdict": "valid", "reasons": []})
    assert broken.why == "overlap: 0.05, at most 0.01"
    assert not broken.invalid
    kinds = [wrong, broken, Trial(1.0, why="gone"), Trial(1.0, why="no", refused=True), Trial(1.0)]
    assert [each.broken_by for each in kinds] == ["invalid", "overlap", "stopped", "refused", ""]


@pytest.mark.parametrize(("state", "invalid"), [({"diagnosis": {}}, True), ({}, False)])
def test_a_failed_run_says_that_there_is_no_answer_by_its_diagnosis(tmp_path, state, invalid):
    run = RunDirectory(tmp_path / "run")
    run.path.mkdir()
    run.write_state(state="failed", faults=["not a number in: kinetic_energy_j"], **state)
    trial = trial_of(task_of("x", read_scene(PAIR.path), run.path), 1.0, Studied(PAIR))
    assert (trial.holds, trial.invalid) == (False, invalid)
    assert trial.why == "not a number in: kinetic_energy_j"


def test_a_case_that_is_tame_is_not_as_expected(tmp_path, monkeypatch):
    """Everything holds where nothing happens."""
    results = {"verdict": "valid", "reasons": []}
    held = Trial(1.0, (Invariant("overlap", 0.005, 0.01),))
    monkeypatch.setattr(module, "is_done", lambda _folder: True)
    monkeypatch.setattr(module, "_trial_by", lambda *_args: held)
    monkeypatch.setattr(module, "read_ran", lambda _folder: results)
    monkeypatch.setattr(module, "what_is_missing", lambda *_args: "nothing touches")
    (studied,) = study_stability([PAIR], tmp_path, lambda _tasks: {}, margins=False)
    assert studied.own.why == "it is not hard: nothing touches"
    assert not studied.as_expected


def test_what_is_written(tmp_path: Path):
    held = Trial(1.0, (Invariant("overlap", 0.005, 0.01), Invariant("lost", 0.0, 0.0)))
    studied = Studied(PAIR, own=held, step_s=1e-5)
    studied.trials = [Trial(2.0, held.invariants), Trial(4.0, why="lost: 1, at most 0")]
    refused = Studied(HardCase("same_place", "refused"), own=Trial(1.0, why="no", refused=True))
    points = [Point(f, e, f**2, 2 * f**2) for e in (0.5, 1.0) for f in (0.01, 0.1, 1.0)]
    results = write_results([studied, refused], points, tmp_path)
    assert results["broken"] == []
    assert results == json.loads((tmp_path / "stability.json").read_text())
    table = pd.read_csv(tmp_path / "stability.csv").set_index("case")
    row = table.loc["restitution_one"]
    assert (row["hardest_invariant"], row["share_of_limit"]) == ("overlap", 0.5)
    assert (row["margin"], row["breaks_at"], row["breaks_by"]) == (2.0, 4.0, "lost: 1, at most 0")
    assert table.loc["same_place", "why"] == "no"
    assert (tmp_path / "stability.png").stat().st_size > 10_000
