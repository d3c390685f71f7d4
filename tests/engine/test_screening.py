"""A run with a screened effect: named wherever one looks, and the run without the effect."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from liggghts_driver.results.positions import iter_instants
from liggghts_driver.scene import make_scene
from liggghts_driver.solve import load, solve

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.engine

SCENE: dict[str, Any] = {
    "particles": {"density": 2500.0, "youngs_modulus": 1e7, "poissons_ratio": 0.25},
    "spheres": [
        {"radius": 1e-3, "position": [-0.004, 0.0, 0.0], "velocity": [0.05, 0.0, 0.0]},
        {"radius": 1e-3, "position": [0.004, 0.0004, 0.0]},
    ],
    "contact": {"restitution": 0.8},
    "box": {"low": [-0.02, -0.01, -0.01], "high": [0.02, 0.01, 0.01]},
    "time": {"duration": 0.2},
    "output": {"samples": 10, "frames": 10, "images": 0},
}
#: 1e-4 of the force that stops the first sphere in the box, m v^2 / L.
FAINT = {"acceleration": [0.0, 0.0, -6e-6]}


def test_what_is_screened_is_named_and_gone(tmp_path: Path) -> None:
    plain = solve(make_scene(SCENE), tmp_path / "plain")
    kept = solve(make_scene({**SCENE, "gravity": FAINT}), tmp_path / "kept")
    asked = make_scene({**SCENE, "gravity": FAINT, "effects": {"screen": 0.01}})
    screened = solve(asked, tmp_path / "screened")
    assert screened.results["effects"]["screened"] == ["gravity"]
    assert kept.results["effects"]["screened"] == []
    assert any("gravity" in note for note in screened.results["notes"])
    report = (tmp_path / "screened/report.html").read_text(encoding="utf-8")
    assert "too weak" in report
    assert "too weak" not in (tmp_path / "kept/report.html").read_text(encoding="utf-8")
    ends = [
        list(iter_instants(solution.directory))[-1].velocities_m_s
        for solution in (plain, screened, kept)
    ]
    # Screened is without, to the last bit; kept falls, if only by a t.
    assert np.array_equal(ends[0], ends[1])
    assert ends[2][:, 2] == pytest.approx(-6e-6 * 0.2, rel=1e-6)


def test_a_screened_run_is_known_by_the_scene_that_asked(tmp_path: Path) -> None:
    asked = make_scene({**SCENE, "gravity": FAINT, "effects": {"screen": 0.01}})
    solve(asked, tmp_path / "run")
    assert json.loads((tmp_path / "run/scene.json").read_text(encoding="utf-8"))["gravity"]
    assert solve(asked, tmp_path / "run").reused
    assert load(tmp_path / "run").results["effects"]["screened"] == ["gravity"]
