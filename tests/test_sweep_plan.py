"""The plan of a sweep: its points, its seeds, its mistakes, and how it is kept."""

from __future__ import annotations

import contextlib
import json
import shutil
import time

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from small_scenes import GONE, INFILTRATION, changed

from liggghts_driver.errors import RunFolderError, SweepError
from liggghts_driver.identity import scene_hash
from liggghts_driver.resources import cases_dir
from liggghts_driver.scene import read_scene
from liggghts_driver.sweeps.model import SlurmSettings
from liggghts_driver.sweeps.plan import PLAN_FILE, make_plan, read_plan, write_plan

SWEEP = """
title = "Two axes"
scene = "scene.json"
replicates = 3

[set]
output.frames = 2

[resources]
ranks = 2
walltime_s = 600.0
pack = 4
retries = 2

[slurm]
partition = "long"
options = ["--exclusive"]

[[axes]]
key = "pressure.gradient"
values = [5, 10.0]

[[axes]]
key = "drag.scheme"
values = ["held", "implicit"]
"""


@pytest.fixture
def sweep(tmp_path):
    """What writes a sweep file beside the scene of forty particles."""
    (tmp_path / "scene.json").write_text(json.dumps(INFILTRATION))

    def write(text: str = SWEEP):
        path = tmp_path / "sweep.toml"
        path.write_text(text)
        return path

    return write


def mistakes_in(path, *overrides: str) -> list[str]:
    with pytest.raises(SweepError) as caught:
        make_plan(path, overrides)
    return [line.removeprefix("  - ") for line in str(caught.value).splitlines()[1:]]


def test_a_plan_says_what_the_file_says(sweep):
    plan = make_plan(sweep())
    assert (plan.title, plan.source) == ("Two axes", "sweep.toml")
    assert plan.axes == ("pressure.gradient", "drag.scheme")
    assert (plan.retries, plan.pack) == (2, 4)
    assert plan.slurm == SlurmSettings(partition="long", options=("--exclusive",))
    assert plan.base == changed(INFILTRATION, {"output.frames": 2})
    assert len(plan.points) == 12
    assert {(p.ranks, p.nodes, p.walltime_s) for p in plan.points} == {(2, 1, 600.0)}


def test_all_combinations_come_before_the_next_replicate(sweep):
    points = make_plan(sweep()).points
    assert [point.index for point in points] == list(range(12))
    assert [point.replicate for point in points] == [0] * 4 + [1] * 4 + [2] * 4
    assert [tuple(point.values.values()) for point in points[4:8]] == [
        (5, "held"), (5, "implicit"), (10.0, "held"), (10.0, "implicit")
    ]  # fmt: skip


def test_a_run_is_named_by_the_hash_of_its_points_scene(sweep):
    plan = make_plan(sweep())
    for point in plan.points:
        scene = plan.scene(point)
        assert point.run == scene_hash(scene)[:16]
        assert scene.seed == point.seed
        assert scene.pressure.gradient == point.values["pressure.gradient"]
        assert scene.drag.scheme == point.values["drag.scheme"]
        assert scene.output.frames == 2
    assert len({point.run for point in plan.points}) == 12


def test_replicates_have_the_same_seeds_in_every_combination(sweep):
    points = make_plan(sweep()).points
    seeds = {}
    for point in points:
        seeds.setdefault(tuple(point.values.items()), []).append(point.seed)
    assert len({tuple(found) for found in seeds.values()}) == 1
    assert len({points[k].seed for k in (0, 4, 8)}) == 3


def test_without_a_root_the_first_replicate_has_the_scenes_seed(sweep):
    one = make_plan(sweep(SWEEP.replace("replicates = 3", "")), ["seed=42"])
    three = make_plan(sweep(), ["seed=42"])
    four = make_plan(sweep(SWEEP.replace("replicates = 3", "replicates = 4")), ["seed=42"])
    assert {point.seed for point in one.points} == {42}
    assert three.points[:4] == one.points
    assert four.points[:12] == three.points


def test_a_root_seed_gives_every_seed(sweep):
    def seeds(root: int) -> list[int]:
        plan = make_plan(sweep(f"root_seed = {root}\n{SWEEP}"))
        return [point.seed for point in plan.points[::4]]

    assert seeds(1) == seeds(1)
    assert not {1, *seeds(1)} & set(seeds(2))
    assert len(set(seeds(1))) == 3


def test_a_seed_may_be_an_axis(sweep):
    plan = make_plan(sweep('scene = "scene.json"\n[[axes]]\nkey = "seed"\nvalues = [3, 4]\n'))
    assert [point.seed for point in plan.points] == [3, 4]
    assert [plan.scene(point).seed for point in plan.points] == [3, 4]


def test_points_of_one_scene_share_their_run(sweep):
    text = 'scene = "scene.json"\n[[axes]]\nkey = "pressure.gradient"\nvalues = [10, 5, 10.0]\n'
    plan = make_plan(sweep(text))
    runs = [point.run for point in plan.points]
    assert runs[0] == runs[2] != runs[1]
    assert set(plan.costs) == set(runs)


def test_a_sweep_without_axes_is_its_replicates(sweep):
    plan = make_plan(sweep('scene = "scene.json"\nreplicates = 5\n'))
    assert plan.axes == ()
    assert [dict(point.values) for point in plan.points] == [{}] * 5
    assert len({point.run for point in plan.points}) == 5


def test_resources_may_follow_a_key(sweep):
    plan = make_plan(
        sweep(
            'scene = "scene.json"\nresources.nodes = 3\n[[axes]]\n'
            'keys = ["particles.count", "resources.ranks", "resources.walltime_s"]\n'
            "values = [[20, 1, 60.0], [40, 2, 120.0]]\n"
        )
    )
    assert plan.axes == ("particles.count",)
    assert [dict(point.values) for point in plan.points] == [
        {"particles.count": 20}, {"particles.count": 40}
    ]  # fmt: skip
    assert [(p.ranks, p.nodes, p.walltime_s) for p in plan.points] == [(1, 3, 60.0), (2, 3, 120.0)]


def test_the_scene_may_be_a_shipped_case_and_overrides_go_before_set(tmp_path):
    path = tmp_path / "sweep.toml"
    path.write_text('scene = "infiltration_small"\n[set]\ntime.duration = 10.0\n')
    plan = make_plan(path, ["time.duration=5"])
    expected = read_scene(cases_dir() / "infiltration_small.toml", ["time.duration=5"])
    assert plan.scene(plan.points[0]) == expected
    assert plan.title == "sweep"


@pytest.mark.parametrize("name", ["gradient", "friction"])
def test_the_shipped_sweeps_are_faultless(name):
    plan = make_plan(cases_dir() / "sweeps" / f"{name}.toml")
    assert len(plan.points) == {"gradient": 15, "friction": 32}[name]


def test_the_template_is_found_beside_the_sweep(sweep, tmp_path):
    (tmp_path / "job.j2").write_text("")
    text = 'scene = "scene.json"\nslurm.template = "job.j2"\n'
    assert make_plan(sweep(text)).slurm.template == str((tmp_path / "job.j2").resolve())
    (line,) = mistakes_in(sweep(text.replace("job", "none")))
    assert line.startswith("slurm.template = 'none.j2': there is no file")


BAD = """
titel = "x"
scene = "scene.json"
replicates = 0
[set]
fluid.viscosity = -1.0
specimen.solid_fraction.x = 1
[resources]
ranks = 1.5
[slurm]
options = ["exclusive"]
partition = "two words"
template = 3
[[axes]]
key = "pressure.gradient"
values = [1.0, nan, 2.0, "a"]
[[axes]]
key = "contact.friction"
from = 0
[[axes]]
key = "contact.friction"
values = []
[[axes]]
key = "particles.count"
values = [40, -1]
"""


def test_every_mistake_is_in_one_message(sweep):
    lines = mistakes_in(sweep(BAD), "nonsense")
    expected = [
        "titel = 'x': there is no such key; did you mean title?",
        "replicates = 0: must be greater than or equal to 1",
        "resources.ranks = 1.5: must be a valid integer",
        "slurm.options[0] = 'exclusive': must begin with -",
        "slurm.partition = 'two words': must be one word",
        "slurm.template = 3: must be a valid string",
        "axes[1].to (missing)",
        "axes[1].count (missing)",
        "axes[2].values = []: no points",
        "contact.friction = 'given twice': stands on axes[1] and on axes[2]",
        "set.specimen.solid_fraction.x = 1: solid_fraction is not a table",
        "--set 'nonsense': must be section.key=value",
        "fluid.viscosity = -1.0: must be greater than 0",  # at every point: one line
        "2 of 8 points, the first with pressure.gradient = nan, particles.count = 40: pressure.",
        "2 of 8 points, the first with pressure.gradient = 'a', particles.count = 40: pressure.",
        "4 of 8 points, the first with pressure.gradient = 1.0, particles.count = -1: particles.c",
    ]
    missing = [words for words in expected if not any(line.startswith(words) for line in lines)]
    assert not missing, lines
    assert len(lines) == len(expected)


def test_the_same_mistake_of_many_points_is_one_line(sweep):
    text = SWEEP.replace("values = [5, 10.0]", "values = [5, inf, -inf]").replace(
        "replicates = 3", "replicates = 10"
    )
    (line,) = mistakes_in(sweep(text))
    # Two of three gradients, with two schemes each, ten times.
    assert line.startswith("40 of 60 points, the first with pressure.gradient = inf, drag.scheme")


def test_mistakes_of_different_keys_stay_apart(sweep):
    text = (
        'scene = "scene.json"\n[[axes]]\nkeys = ["fluid.density", "fluid.viscosity"]\n'
        "values = [[-1.0, 1.0], [1.0, -1.0]]\n"
    )
    lines = mistakes_in(sweep(text))
    assert [line.split(": ")[1].split(" = ")[0] for line in lines] == [
        "fluid.density", "fluid.viscosity"
    ]  # fmt: skip


def test_resources_out_of_bounds_are_told_beside_the_scenes_mistakes(sweep):
    text = (
        'scene = "scene.json"\n[[axes]]\nkeys = ["fluid.density", "resources.ranks"]\n'
        "values = [[-1.0, 0], [1.0, 1]]\n"
    )
    lines = mistakes_in(sweep(text))
    assert len(lines) == 2
    assert "resources.ranks = 0: must be greater than or equal to 1" in lines[0]
    assert "fluid.density = -1.0" in lines[1]


def test_a_step_above_its_bound_at_some_points_is_told_before_they_run(sweep):
    text = (
        'scene = "scene.json"\nset.time.step = 5e-5\n[[axes]]\n'
        'key = "particles.youngs_modulus"\nvalues = [1e7, 1e9, 1e10]\n'
    )
    (line,) = mistakes_in(sweep(text))
    assert line.startswith("2 of 3 points, the first with particles.youngs_modulus = 1000000000.0")
    assert "time.step = 5e-05 s: must be at most" in line


def test_what_is_not_there_is_told(sweep, tmp_path):
    with pytest.raises(SweepError, match=r"none\.toml: cannot be read"):
        make_plan(tmp_path / "none.toml")
    with pytest.raises(SweepError, match="not valid toml"):
        make_plan(sweep("scene = "))
    scene, replicates = mistakes_in(sweep("replicates = -1"))
    assert scene.startswith("scene (missing): it is needed; give the scene file")
    assert replicates.startswith("replicates = -1: must be greater than or equal to 1; give the nu")
    (line,) = mistakes_in(sweep('scene = "elsewhere.toml"'))
    assert line.startswith("scene = 'elsewhere.toml'")
    assert "check the path" in line


def test_a_scene_that_lacks_what_varies_is_whole_at_every_point(sweep, tmp_path):
    (tmp_path / "scene.json").write_text(
        json.dumps(changed(INFILTRATION, {"particles.count": GONE}))
    )
    text = 'scene = "scene.json"\n[[axes]]\nkey = "particles.count"\nvalues = [20, 40]\n'
    assert len(make_plan(sweep(text)).points) == 2


def test_a_plan_is_read_as_it_was_written(sweep, tmp_path):
    plan = make_plan(sweep())
    write_plan(plan, tmp_path / "out")
    assert read_plan(tmp_path / "out") == plan
    alone = make_plan(sweep('scene = "scene.json"\n'))
    write_plan(alone, tmp_path / "alone")
    assert read_plan(tmp_path / "alone") == alone


def test_the_same_file_gives_the_same_bytes(sweep, tmp_path):
    for folder in ("one", "two"):
        write_plan(make_plan(sweep()), tmp_path / folder)
    texts = [(tmp_path / folder / PLAN_FILE).read_bytes() for folder in ("one", "two")]
    assert texts[0] == texts[1]


def test_a_plan_that_is_there_already_is_left_alone(sweep, tmp_path):
    out = tmp_path / "out"
    write_plan(make_plan(sweep()), out)
    before = (out / PLAN_FILE).stat().st_mtime_ns, (out / PLAN_FILE).stat().st_ino
    write_plan(make_plan(sweep()), out)
    assert ((out / PLAN_FILE).stat().st_mtime_ns, (out / PLAN_FILE).stat().st_ino) == before


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("values = [5, 10.0]", "values = [2, 5, 10.0]"),
        ("replicates = 3", "replicates = 4"),
        ("walltime_s = 600.0", "walltime_s = 900.0"),
    ],
)
def test_an_extended_sweep_takes_the_place_of_its_plan(sweep, tmp_path, old, new):
    out = tmp_path / "out"
    write_plan(make_plan(sweep()), out)
    extended = make_plan(sweep(SWEEP.replace(old, new)))
    write_plan(extended, out)
    assert read_plan(out) == extended


@pytest.mark.parametrize(
    ("old", "new", "lost"),
    [
        ("values = [5, 10.0]", "values = [5]", "6 of its 12 runs"),
        ("output.frames = 2", "output.frames = 3", "12 of its 12 runs"),
    ],
)
def test_another_sweep_is_refused_the_folder(sweep, tmp_path, old, new, lost):
    out = tmp_path / "out"
    plan = make_plan(sweep())
    write_plan(plan, out)
    with pytest.raises(RunFolderError) as caught:
        write_plan(make_plan(sweep(SWEEP.replace(old, new))), out)
    assert str(out) in str(caught.value)
    assert lost in str(caught.value)
    assert "--out" in str(caught.value)
    assert read_plan(out) == plan


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"axes": [], "points": {}}'])
def test_a_file_that_is_no_plan_is_kept(sweep, tmp_path, text):
    (tmp_path / PLAN_FILE).write_text(text)
    with pytest.raises(SweepError, match=PLAN_FILE):
        read_plan(tmp_path)
    with pytest.raises(RunFolderError, match="--out"):
        write_plan(make_plan(sweep()), tmp_path)
    assert (tmp_path / PLAN_FILE).read_text() == text


def test_a_file_is_no_folder_for_a_plan(sweep, tmp_path):
    with pytest.raises(RunFolderError, match="--out"):
        write_plan(make_plan(sweep()), tmp_path / "scene.json")


ANYTHING = st.recursive(
    st.one_of(
        st.none(), st.booleans(), st.integers(-3, 20), st.just(10**12), st.floats(), st.text()
    ),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=6,
)
AXIS_KEYS = ("key", "keys", "values", "from", "to", "count", "scale", "sample", "ranges")
TABLES = {
    "scene": "scene.json",
    "set": {"output.frames": 2},
    "resources": {"ranks": 1},
    "slurm": {"options": []},
    "axes": [{"key": "contact.friction", "values": [0.1, 0.2]}],
}


@given(
    st.dictionaries(st.sampled_from([*TABLES, "title", "replicates", "root_seed"]), ANYTHING),
    st.dictionaries(st.sampled_from(AXIS_KEYS), ANYTHING),
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
def test_any_file_gives_a_plan_that_can_be_kept_or_one_message(sweep, tmp_path, tables, axis):
    path = sweep().with_name("any.json")
    axes = [*TABLES["axes"], *([axis] if axis else [])]
    path.write_text(json.dumps({**TABLES, "axes": axes, **tables}))
    with contextlib.suppress(SweepError):
        plan = make_plan(path)
        shutil.rmtree(tmp_path / "out", ignore_errors=True)
        write_plan(plan, tmp_path / "out")
        assert read_plan(tmp_path / "out") == plan


def test_a_folder_without_a_plan_is_told(tmp_path):
    with pytest.raises(SweepError, match=PLAN_FILE):
        read_plan(tmp_path)


GRID = """
scene = "infiltration_small"
replicates = {replicates}
[[axes]]
key = "pressure.gradient"
from = 1.0
to = 20.0
count = {count}
[[axes]]
key = "contact.friction"
from = 0.0
to = 1.0
count = 10
"""


def test_a_thousand_points_are_planned_in_a_moment(tmp_path):
    path = tmp_path / "sweep.toml"
    path.write_text(GRID.format(replicates=1, count=100))
    start = time.perf_counter()
    plan = make_plan(path)
    took_s = time.perf_counter() - start
    assert len(plan.points) == len(plan.costs) == 1000
    # 0.7 s on an idle core; a machine that runs other tests takes up to twice that.
    assert took_s < 2.0


def test_a_large_plan_is_read_in_a_moment(tmp_path):
    path = tmp_path / "sweep.toml"
    path.write_text(GRID.format(replicates=20, count=100))
    plan = make_plan(path)
    write_plan(plan, tmp_path)
    times_s = []
    for _ in range(3):
        start = time.perf_counter()
        read = read_plan(tmp_path)
        times_s.append(time.perf_counter() - start)
    assert len(read.points) == 20000
    # 0.08 s on an idle core; checking the scenes again would take 2 s.
    assert min(times_s) < 0.3
