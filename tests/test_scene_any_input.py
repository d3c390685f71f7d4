"""Whatever is given gives a scene or a SceneError; a scene that is written and read is the same."""

from __future__ import annotations

import copy
import json

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from small_scenes import COLLISION, INFILTRATION, changed

from liggghts_driver.errors import SceneError
from liggghts_driver.identity import scene_hash
from liggghts_driver.resources import cases_dir
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.scene import Scene, make_scene, read_scene

CASES = sorted(cases_dir().glob("*.toml"))
WORDS = sorted(
    {*Scene.model_fields}
    | {key for table in Scene.model_json_schema()["$defs"].values() for key in table["properties"]}
)

names = st.sampled_from(WORDS) | st.text(max_size=5)
atoms = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=5)
    | st.sampled_from(["x-", "piston", "bulk", "exact", 10**400, -0.0, 1e-320])
    | st.dates()
)
trees = st.recursive(
    atoms,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(names, inner, max_size=4),
    max_leaves=12,
)


def scene_or_error(make):
    """What ``make`` returns, which must be a scene; None if it raises a SceneError."""
    try:
        scene = make()
    except SceneError:
        return None
    assert isinstance(scene, Scene)
    return scene


@given(st.dictionaries(names, trees, max_size=6))
@settings(deadline=None)
def test_any_tables(data):
    scene_or_error(lambda: make_scene(data))


def places(tables, path=()):
    """Every place in some tables, leaves and tables alike."""
    items = tables.items() if isinstance(tables, dict) else enumerate(tables)
    for key, value in items:
        yield (*path, key)
        if isinstance(value, (dict, list)):
            yield from places(value, (*path, key))


@given(st.sampled_from([COLLISION, INFILTRATION]), st.data())
@settings(deadline=None)
def test_a_good_scene_with_anything_in_one_place(tables, data):
    broken = copy.deepcopy(tables)
    *parents, last = data.draw(st.sampled_from(list(places(tables))))
    place = broken
    for parent in parents:
        place = place[parent]
    place[last] = data.draw(trees)
    scene_or_error(lambda: make_scene(broken))


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return tmp_path_factory.mktemp("any") / "scene.toml"


@given(st.text(alphabet=st.characters(exclude_categories=["Cs"])))
@settings(deadline=None)
def test_any_text(file, text):
    file.write_text(text, encoding="utf-8")
    scene_or_error(lambda: read_scene(file))


@given(st.binary())
@settings(deadline=None)
def test_any_bytes(file, content):
    file.write_bytes(content)
    scene_or_error(lambda: read_scene(file))


@given(st.sampled_from(CASES), st.integers(0), st.integers(0, 40), st.text(max_size=3))
@settings(deadline=None)
def test_a_case_with_a_piece_cut_out_and_another_put_in(file, case, place, length, piece):
    text = case.read_text(encoding="utf-8")
    place %= len(text)
    file.write_text(text[:place] + piece.replace("\ud800", "") + text[place + length :])
    scene_or_error(lambda: read_scene(file))


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("long.toml", f"seed = {'9' * 5000}"),
        ("long.json", f'{{"seed": {"9" * 5000}}}'),
        ("deep.toml", f"seed = {'[' * 100_000}"),
        ("deep.json", "[" * 100_000),
    ],
    ids=lambda value: value[:9],
)
def test_what_the_parsers_themselves_cannot_bear(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    with pytest.raises(SceneError, match=name):
        read_scene(tmp_path / name)


@pytest.mark.parametrize("name", ["absent.toml", ".", "absent/scene.toml"])
def test_what_cannot_be_read(tmp_path, name):
    with pytest.raises(SceneError, match="cannot be read"):
        read_scene(tmp_path / name)


@pytest.mark.parametrize("text", ["a = [", "= 1", "a = 1\na = 2", "[a]\n[a]", "a\x00b = 1"])
def test_what_is_no_toml_is_told_its_line(tmp_path, text):
    (tmp_path / "scene.toml").write_text(text)
    with pytest.raises(SceneError, match=r"scene\.toml: not valid toml: .*(line|end)"):
        read_scene(tmp_path / "scene.toml")


@pytest.mark.parametrize("text", ["", "[1, 2]", "3", "null", "{"])
def test_what_is_no_table_in_json(tmp_path, text):
    (tmp_path / "scene.json").write_text(text)
    with pytest.raises(SceneError, match=r"scene\.json"):
        read_scene(tmp_path / "scene.json")


finite = st.floats(allow_nan=False, allow_infinity=False)
positive = st.floats(1e-300, 1e300)
CHANGES = st.fixed_dictionaries(
    {},
    optional={
        "title": st.text(st.characters(exclude_categories=["C", "Zl", "Zp"]), max_size=10),
        "seed": st.integers(0, 2**80),
        "fluid.viscosity": positive,
        "fluid.velocity": finite,
        "fluid.velocity_outside": st.sampled_from(["piston", "accelerating", "constant", "still"]),
        "specimen.height": positive,
        "specimen.cut": st.sampled_from(["bulk", "inside"]),
        "specimen.exit": st.sampled_from(["open", "closed"]),
        "piston.mass": positive,
        "pressure.gradient": finite,
        "drag.refresh": positive,
        "drag.scheme": st.sampled_from(["implicit", "held", "exact"]),
        "gravity.acceleration": st.tuples(finite, finite, finite),
        "spheres": st.lists(
            st.fixed_dictionaries(
                {"radius": positive, "position": st.tuples(finite, finite, finite)},
                optional={"kind": st.just("grain"), "spin": st.tuples(finite, finite, finite)},
            ),
            max_size=2,
        ),
        "walls.youngs_modulus": positive,
        "output.paraview": st.booleans(),
        "output.flowing_above": st.floats(0, 1),
    },
)


@given(CHANGES)
@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_scene_written_and_read_is_the_same(tmp_path, changes):
    scene = scene_or_error(lambda: make_scene(changed(INFILTRATION, changes)))
    if scene is None:
        return
    directory = RunDirectory(tmp_path)
    directory.write_scene(scene)
    assert directory.read_scene() == scene
    assert scene_hash(directory.read_scene()) == scene_hash(scene)
    # The file that a run keeps is a scene file as well.
    assert read_scene(directory.scene) == scene


@pytest.mark.parametrize("case", CASES, ids=lambda path: path.stem)
def test_shipped_cases_load_and_survive_writing(tmp_path, case):
    scene = read_scene(case)
    assert scene.title
    directory = RunDirectory(tmp_path)
    directory.write_scene(scene)
    assert directory.read_scene() == scene
    json.loads(directory.scene.read_text(encoding="utf-8"))


def test_there_are_shipped_cases():
    assert {"infiltration", "infiltration_small", "settling_sphere", "two_spheres"} <= {
        case.stem for case in CASES
    }
