"""Overrides of single keys: the same checks as for the file, and all mistakes together."""

from __future__ import annotations

import contextlib
import json

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from small_scenes import COLLISION, INFILTRATION, changed

from liggghts_driver.errors import SceneError
from liggghts_driver.resources import cases_dir
from liggghts_driver.scene import Scene, read_scene

CASE = cases_dir() / "infiltration_small.toml"


@pytest.fixture
def collision(tmp_path):
    path = tmp_path / "collision.json"
    path.write_text(json.dumps(COLLISION))
    return path


def message(path, *overrides: str) -> str:
    with pytest.raises(SceneError) as caught:
        read_scene(path, overrides)
    return str(caught.value)


def test_several_overrides_of_any_kind():
    scene = read_scene(
        CASE,
        [
            "pressure.gradient=5",
            "drag.scheme=held",  # a bare word is a text
            'title = "with = and blanks"',
            "output.paraview=true",
            "gravity.acceleration=[0, 0, -1.5]",  # a table that the file does not have
            " time.step_fraction = 0.05 ",
            "pressure.gradient=20",  # the last one counts
        ],
    )
    assert scene.pressure.gradient == 20.0
    assert scene.drag.scheme == "held"
    assert scene.title == "with = and blanks"
    assert scene.output.paraview is True
    assert scene.gravity.acceleration == (0.0, 0.0, -1.5)
    assert scene.time.step_fraction == 0.05
    # Nothing else has changed.
    as_file = read_scene(CASE)
    assert scene.particles == as_file.particles
    assert scene.specimen == as_file.specimen


def test_a_sphere_of_the_list(collision):
    scene = read_scene(collision, ["spheres[1].radius=0.001", "spheres[0].spin=[1, 2, 3]"])
    assert [sphere.radius for sphere in scene.spheres] == [0.0015, 0.001]
    assert scene.spheres[0].spin == (1.0, 2.0, 3.0)


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("pressure.gradient=nan", ["pressure.gradient = nan", "finite"]),
        ("pressure.gradient=true", ["pressure.gradient = True", "number"]),
        ("pressure.gradient=ten", ["pressure.gradient = 'ten'", "number"]),
        ("pressure.gradient=", ["pressure.gradient = ''", "number"]),
        ("pressure.gradiant=1", ["pressure.gradiant = 1", "did you mean gradient?"]),
        ("presure.gradient=1", ["presure", "did you mean pressure?"]),
        ("time.duration=2026-01-01", ["time.duration", "number"]),
        ("fluid=1", ["fluid = 1", "[fluid]"]),
    ],
)
def test_an_override_is_checked_like_the_file(override, words):
    text = message(CASE, override)
    assert "1 mistake\n" in text
    assert all(word in text for word in words)


@pytest.mark.parametrize(
    "override", ["duration", "=1", ".duration=1", "time.=1", "time..step=1", "", "=", "."]
)
def test_what_is_no_override_is_told_the_form(override):
    text = message(CASE, override)
    assert f"--set {override!r}: must be section.key=value" in text


@pytest.mark.parametrize("override", ["title.x=1", "seed.x.y=1", "fluid.density.x=1"])
def test_a_key_of_no_table_is_refused(override):
    text = message(CASE, override)
    assert f"--set {override!r}" in text
    assert "is not a table" in text


@pytest.mark.parametrize("override", ["spheres[2].radius=1", "spheres[-1].radius=1", "spheres.x=1"])
def test_a_sphere_that_is_not_there_is_refused(collision, override):
    assert f"--set {override!r}" in message(collision, override)


@pytest.mark.parametrize(
    "override",
    [
        pytest.param("fluid[3].density=1000"),
        pytest.param("spheres[0].radius=0.001"),
    ],
)
def test_an_index_into_what_is_no_list_is_refused(override):
    assert f"--set {override!r}" in message(CASE, override)


def test_digits_that_are_no_number_are_refused(collision):
    assert "spheres[²]" in message(collision, "spheres[²].radius=1")


def test_bad_overrides_and_the_files_mistakes_in_one_message(tmp_path):
    path = tmp_path / "bad.json"
    path.write_text(json.dumps(changed(INFILTRATION, {"fluid.viscosity": -1.0})))
    text = message(path, "nonsense", "pressure.gradient.x=1", "time.duration=-3")
    assert "'nonsense'" in text
    assert "'pressure.gradient.x=1'" in text
    assert "bad.json: 2 mistakes" in text
    assert "fluid.viscosity = -1.0" in text
    assert "time.duration = -3" in text


def test_the_file_is_not_changed(collision):
    before = collision.read_bytes()
    read_scene(collision, ["time.duration=3"])
    assert collision.read_bytes() == before


KEYS = st.sampled_from(["time.duration", "spheres[0].radius", "box.low", "fluid.density", "seed"])


@given(st.lists(st.one_of(st.text(), st.builds("{}={}".format, KEYS, st.text())), max_size=3))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
def test_any_override_gives_a_scene_or_a_scene_error(collision, overrides):
    with contextlib.suppress(SceneError):
        assert isinstance(read_scene(collision, overrides), Scene)
