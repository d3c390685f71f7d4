"""CONTRIBUTING.md's example of a new effect, followed to the letter in a copy of the package."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import liggghts_driver
from liggghts_driver.resources import cases_dir, templates_dir
from liggghts_driver.rundir import RunDirectory

CONTRIBUTING = Path(liggghts_driver.__file__).parents[1] / "CONTRIBUTING.md"
SCENE = """
[particles]
density = 2500.0
youngs_modulus = 1e7
poissons_ratio = 0.25

[[spheres]]
radius = 1e-3
position = [0.0, 0.0, 0.0]

[contact]
restitution = 0.5

[box]
low = [-0.01, -0.01, -0.01]
high = [0.05, 0.01, 0.01]

[time]
duration = 0.25
step = 1e-4

[output]
samples = 10
frames = 10
images = 0

"""


def blocks() -> tuple[str, str, str]:
    """The effect's code, its fragment, and its lines in a scene."""
    text = CONTRIBUTING.read_text(encoding="utf-8")
    section = text.split("## Add an effect")[1].split("\n## ")[0]
    code, fragment, scene = re.findall(r"```\w*\n(.*?)```", section, flags=re.DOTALL)
    return code, fragment, scene


@pytest.fixture(scope="module")
def extended(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the package with the new effect: one file, one fragment."""
    root = tmp_path_factory.mktemp("extended")
    shutil.copytree(Path(liggghts_driver.__file__).parent, root / "liggghts_driver")
    shutil.copytree(templates_dir(), root / "templates")
    shutil.copytree(cases_dir(), root / "cases")
    code, fragment, scene = blocks()
    (root / "liggghts_driver/effects/magnet.py").write_text(code, encoding="utf-8")
    (root / "templates/effects/magnet.j2").write_text(fragment, encoding="utf-8")
    (root / "with.toml").write_text(SCENE + scene, encoding="utf-8")
    (root / "without.toml").write_text(SCENE, encoding="utf-8")
    return root


def driver(root: Path, *arguments: str, code: int = 0) -> str:
    """What the extended package prints."""
    done = subprocess.run(
        [sys.executable, "-m", "liggghts_driver", *arguments],
        cwd=root,
        env={**os.environ, "PYTHONPATH": str(root)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == code, done.stderr
    return done.stdout + done.stderr


def test_its_lines_are_added_and_nothing_else_changes(extended: Path) -> None:
    for name in ("with", "without"):
        driver(extended, "deck", f"{name}.toml", "--out", f"deck-{name}")
    with_it, without = (
        (extended / f"deck-{name}/deck.in").read_text(encoding="utf-8").splitlines()
        for name in ("with", "without")
    )
    own = ["fix             magnet particles gravity 0.5 vector 1.0 0.0 0.0"]
    heading = ["", "# ---- 5. Forces on the particles"]
    told = [line for line in with_it if line.startswith("#   magnet")]
    added = [line for line in with_it if line not in without]
    # The scene's hash and, with the speed that may be reached, the comment on the step differ.
    varies = ("# A deck for", "timestep", "print", "#   ", "neighbor")
    assert [line for line in added if not line.startswith(varies)] == [heading[1], *own]
    assert len(told) == 1
    assert "magnet" not in "\n".join(without)


def test_it_is_explained(extended: Path) -> None:
    facts = json.loads(driver(extended, "explain", "with.toml", "--json"))
    (magnet,) = [effect for effect in facts["effects"] if effect["name"] == "magnet"]
    assert magnet["active"]
    assert magnet["motion_share"] == 1.0
    facts = json.loads(driver(extended, "explain", "without.toml", "--json"))
    (magnet,) = [effect for effect in facts["effects"] if effect["name"] == "magnet"]
    assert not magnet["active"]


def test_its_mistakes_are_named(extended: Path) -> None:
    wrong = ["acceleration=-1.0", "strength=2.0"]
    options = [word for text in wrong for word in ("--set", f"effects.settings.magnet.{text}")]
    said = driver(extended, "explain", "without.toml", *options, code=2)
    assert "effects.settings.magnet.acceleration = -1.0: must be from 0 to 1000" in said
    assert (
        "effects.settings.magnet.strength = 2.0: there is no such key; valid: acceleration" in said
    )


@pytest.mark.engine
def test_it_pulls(extended: Path) -> None:
    """v = a t, which velocity Verlet follows exactly."""
    driver(extended, "run", "with.toml", "--out", "run")
    series = (RunDirectory(extended / "run").series).read_text(encoding="utf-8").splitlines()
    names, last = series[0].split(","), series[-1].split(",")
    row = dict(zip(names, map(float, last), strict=True))
    # 1e-9: rounding of 2500 sums.
    assert row["largest_speed_m_s"] == pytest.approx(0.5 * row["time_s"], rel=1e-9)
