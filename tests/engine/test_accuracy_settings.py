"""A scene that asks for an accuracy: the engine runs it with the settings that a study found."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest
from accuracy_studies import put, study_of
from small_scenes import INFILTRATION, scene_of

from liggghts_driver.solve import load, solve

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.engine

#: A tenth of a second: the particles hardly meet, and nothing here is about what they do.
SHORT = {"time.duration": 0.1}


def test_the_run_has_the_settings_and_says_what_is_known_of_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    study = put(study_of(scene_of(INFILTRATION)), tmp_path / "runs/mine/accuracy.json")
    finest = solve(scene_of(INFILTRATION, {**SHORT, "accuracy": "reference"}), "finest")
    draft = solve(scene_of(INFILTRATION, {**SHORT, "accuracy": "draft"}), "draft")
    # A step may be 0.2 of a contact instead of 0.05, and contacts last as long as the stiffness to
    # the power -0.4 says, to rounding. Steps are shortened until the samples fall on whole ones.
    ratio = draft.results["time_step_bound_s"] / finest.results["time_step_bound_s"]
    assert ratio == pytest.approx(4.0 * 10.0**0.4, rel=1e-6)
    assert draft.results["cost"]["steps"] < finest.results["cost"]["steps"] / 5.0
    stored = json.loads((tmp_path / "draft/results.json").read_text(encoding="utf-8"))["accuracy"]
    assert stored["level"] == "draft"
    assert stored["settings"]["contact.stiffness_scale"] == 0.1
    assert stored["expected_reach"] == pytest.approx(0.08)
    assert stored["study"]["file"] == "runs/mine/accuracy.json"
    sentence = "flow within 8 % (95 %) of the finest settings, measured with 8 packings over 10 s"
    assert sentence in stored["sentences"][0]
    assert sentence in (tmp_path / "draft/report.html").read_text(encoding="utf-8")
    # The folder alone tells it again, and a scene that says the same in full finds it finished.
    study.unlink()
    assert load("draft").results["accuracy"] == stored
    written = scene_of(INFILTRATION, {**SHORT, **stored["settings"]})
    assert solve(written, "draft").reused
