"""Where studies of accuracy are found, and what is no study."""

from __future__ import annotations

import copy
import json
import shutil

import pytest
from accuracy_studies import REFERENCE, SOFT, STEP, put, row, study_of
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from small_scenes import INFILTRATION, scene_of

from liggghts_driver.accuracy import lookup, problem_sha256
from liggghts_driver.accuracy.lookup import find_study
from liggghts_driver.errors import SceneError
from liggghts_driver.scene import Scene

SCENE = scene_of(INFILTRATION)
STUDY = study_of(SCENE)
PROBLEM = STUDY["problem_sha256"]


@pytest.fixture
def place(tmp_path, monkeypatch):
    """An empty working folder, and an empty one in place of the shipped cases."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(lookup, "cases_dir", lambda: tmp_path / "shipped")
    return tmp_path


def titled(title: str, *rows, **changes):
    return study_of(SCENE, *rows, title=title, **changes)


def test_nothing_anywhere(place):
    assert find_study(PROBLEM) is None


@pytest.mark.parametrize("folder", ["runs", "runs/study", "runs/mine/study"])
def test_ones_own(place, folder):
    put(STUDY, place / folder / "accuracy.json")
    found = find_study(PROBLEM)
    assert found.study.title == "A made-up study"
    assert found.file == f"{folder}/accuracy.json"


@pytest.mark.parametrize(
    "path", ["accuracy.json", "runs/a/b/c/accuracy.json", "runs/study/other.json"]
)
def test_other_places_are_not_looked_at(place, path):
    put(STUDY, place / path)
    assert find_study(PROBLEM) is None


def test_of_another_problem(place):
    other = study_of(scene_of(INFILTRATION, {"pressure.gradient": 5.0}))
    put(other, place / "runs/study/accuracy.json")
    assert find_study(PROBLEM) is None


def test_a_shipped_one(place):
    put(STUDY, place / "shipped/accuracy/small.json")
    assert find_study(PROBLEM).file == "cases/accuracy/small.json"


def test_ones_own_comes_before_a_shipped_one_that_knows_more(place):
    few = row("step", {"time.step_fraction": 0.2}, 0.3, 0.0, 0.0, replicates=2)
    put(titled("own", few), place / "runs/study/accuracy.json")
    put(titled("shipped"), place / "shipped/accuracy/small.json")
    assert find_study(PROBLEM).study.title == "own"


def test_of_several_the_one_with_the_most_packings(place):
    for replicates in (3, 8, 5):
        many = row("step", {"time.step_fraction": 0.2}, 0.3, 0.0, 0.0, replicates=replicates)
        put(titled(str(replicates), many), place / f"runs/{replicates}/accuracy.json")
    put(titled("long", duration_s=20.0), place / "runs/1/accuracy.json")
    assert find_study(PROBLEM).study.title == "long"  # 8 packings too
    shutil.rmtree(place / "runs/1")
    assert find_study(PROBLEM).study.title == "8"


#: Files that are no study, by what they hold.
BROKEN = {
    "nothing": b"",
    "no text": b"\xff\xfe\x00",
    "no JSON": b"{'study': 'accuracy'}",
    "half": json.dumps(STUDY).encode()[:-40],
    "a list": b"[1, 2]",
    "deep": b"[" * 100_000,
    "another study": json.dumps(STUDY | {"study": "effects"}).encode(),
    "an older study": json.dumps({n: v for n, v in STUDY.items() if n != "finest"}).encode(),
    "not finite": json.dumps(STUDY | {"duration_s": float("nan")}).encode(),
    "a control character": json.dumps(STUDY | {"title": "\x1b[31m"}).encode(),
    "no setting": json.dumps(STUDY | {"finest": {"specimen.width": 0.01}}).encode(),
    "chosen by nothing": json.dumps(STUDY | {"chosen_by": []}).encode(),
}


@pytest.mark.parametrize("name", BROKEN)
def test_what_is_no_study_is_skipped(place, name):
    path = place / "runs/a/accuracy.json"
    path.parent.mkdir(parents=True)
    path.write_bytes(BROKEN[name])
    assert find_study(PROBLEM) is None
    put(STUDY, place / "runs/b/accuracy.json")
    assert find_study(PROBLEM).file == "runs/b/accuracy.json"


def test_a_folder_of_that_name_is_skipped(place):
    (place / "runs/a/accuracy.json").mkdir(parents=True)
    assert find_study(PROBLEM) is None


def places(data, path=()):
    """Every place in some JSON, leaves and containers alike."""
    for key, value in data.items() if isinstance(data, dict) else enumerate(data):
        yield (*path, key)
        if isinstance(value, (dict, list)):
            yield from places(value, (*path, key))


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=4),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner),
    max_leaves=5,
)


@given(st.sampled_from(list(places(STUDY))), VALUES)
@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_study_with_anything_in_one_place_gives_a_scene_or_an_error(place, where, value):
    broken = copy.deepcopy(STUDY)
    *parents, last = where
    inner = broken
    for parent in parents:
        inner = inner[parent]
    inner[last] = value
    put(broken, place / "runs/a/accuracy.json")
    try:
        assert isinstance(scene_of(INFILTRATION, {"accuracy": "draft"}), Scene)
    except SceneError as error:
        assert len(str(error)) > 20  # noqa: PT017 - either is right, a traceback is not


def test_what_is_shipped_is_a_study_of_a_shipped_case():
    """A case that was changed since is another problem, which its study says nothing of."""
    from liggghts_driver.resources import cases_dir
    from liggghts_driver.scene.read import read_problem

    problems = {problem_sha256(read_problem(path)) for path in cases_dir().glob("*.toml")}
    files = sorted((cases_dir() / "accuracy").glob("*.json"))
    found = list(lookup._read((path, path.name) for path in files))
    assert len(found) == len(files)
    assert {each.study.problem_sha256 for each in found} <= problems


def test_rows_of_these_tests_are_as_they_say():
    assert [each["title"] for each in (REFERENCE, STEP, SOFT)] == [
        "reference", "step_fraction 0.2", "step_fraction 0.2, stiffness_scale 0.1"
    ]  # fmt: skip
