"""Every mistake in a scene is named with its key, value, bound and way out; all of them at once."""

from __future__ import annotations

import math
import re

import pydantic
import pytest
from small_scenes import COLLISION, FLUID, GONE, GRAIN, INFILTRATION, MATERIAL, scene_of

from liggghts_driver.errors import SceneError
from liggghts_driver.scene import make_scene

#: name, " = value" or " (missing)", the bound, "; ", the way out.
LINE = re.compile(r"  - (?P<name>.+?) (?:= (?P<value>.+?)|\(missing\)): (?P<bound>.+); (?P<fix>.+)")

GRAINS = {"youngs_modulus": 1.0e6, "poissons_ratio": 0.25, "radius_mean": 0.004}


def mistakes(tables, changes=None) -> dict[str, dict[str, str]]:
    """The mistakes of one message by their names."""
    with pytest.raises(SceneError) as caught:
        scene_of(tables, changes)
    first, *lines = str(caught.value).splitlines()
    found = [match.groupdict() for line in lines if (match := LINE.fullmatch(line))]
    assert len(found) == len(lines), f"not of the form name, value, bound, fix:\n{caught.value}"
    noun = "mistake" if len(found) == 1 else "mistakes"
    assert first == f"scene: {len(found)} {noun}"
    return {mistake.pop("name"): mistake for mistake in found}


SUSPENSION = "particles.count, particles.volume_fraction, reservoir.length"

#: Scene, changes, then of the one mistake: name, value, part of the bound, part of the fix.
ALONE = [
    (COLLISION, {"particles.density": -1.0}, "particles.density", "-1.0", "above|greater", "kg/m3"),
    (COLLISION, {"particles.density": 0}, "particles.density", "0", "greater than 0", "kg/m3"),
    (COLLISION, {"particles.youngs_modulus": GONE}, "particles.youngs_modulus", None, "need", "Pa"),
    (COLLISION, {"particles.poissons_ratio": 0.6}, "particles.poissons_ratio", "0.6", "0.5", "Poi"),
    (COLLISION, {"particles.count": 1.5}, "particles.count", "1.5", "integer", "number of"),
    (COLLISION, {"particles.count": -1}, "particles.count", "-1", "greater than or equal to 0", ""),
    (COLLISION, {"contact.damping_ratio": 0.63}, "contact.damping_ratio", "0.63", "0.62", "xi_n"),
    (COLLISION, {"contact.friction": -0.1}, "contact.friction", "-0.1", "0", "Coulomb"),
    (COLLISION, {"contact": GONE}, "contact", None, "needed", r"\[contact\]"),
    (COLLISION, {"contact": 3}, "contact", "3", "dictionary", r"\[contact\]"),
    (COLLISION, {"time.duration": 0.0}, "time.duration", "0.0", "greater than 0", r"\[s\]"),
    (COLLISION, {"time.step_fraction": 1.1}, "time.step_fraction", "1.1", "equal to 1", "Eq. 21"),
    (COLLISION, {"output.samples": 9}, "output.samples", "9", "10", "rows"),
    (COLLISION, {"output.paraview": 1}, "output.paraview", "1", "boolean", "VTK"),
    (COLLISION, {"seed": -1}, "seed", "-1", "0", "random"),
    (COLLISION, {"title": 7}, "title", "7", "string", "line"),
    (COLLISION, {"box.walls": ["y"]}, r"box.walls\[0\]", "'y'", "'x-', 'x\\+'", ""),
    (INFILTRATION, {"near_field": {"force": 1e-6, "reach": 0.004}}, "near_field.reach", "0.004",
     "diameter, 0.003 m", "shorten"),
    (INFILTRATION, {"contact.cohesion_energy_density": 1e8}, "contact.cohesion_energy_density",
     "1e8|100000000.0", "by themselves", "at most 2.06e\\+04 J/m3"),
    (INFILTRATION, {"drag.scheme": "fast"}, "drag.scheme", "'fast'",
     "'held', 'implicit' or 'none'", "none: no drag"),
    (INFILTRATION, {"drag.carrier": "air"}, "drag.carrier", "'air'", "'coupling' or 'addforce'",
     "fix addforce"),
    (INFILTRATION, {"drag.tolerance": 1.0}, "drag.tolerance", "1.0", "less than 1", "error"),
    (INFILTRATION, {"drag.refresh": 0.0}, "drag.refresh", "0.0", "greater than 0", r"\[s\]"),
    (INFILTRATION, {"specimen.phi": 1.01}, "specimen.phi", "1.01", "1", "Eq. 11"),
    (INFILTRATION, {"specimen.solid_fraction": 1.0}, "specimen.solid_fraction", "1.0", "1", "v_1"),
    (INFILTRATION, {"piston.acceleration": 0}, "piston.acceleration", "0", "0", "m/s2"),
    (INFILTRATION, {"pressure": {}}, "pressure.gradient", None, "needed", "Pa/m"),
    # What no single key shows.
    (COLLISION, {"box": GONE}, "box", None, r"\[specimen\] or \[box\]", "add"),
    (COLLISION, {"spheres": GONE, "particles": {**MATERIAL, "radius_mean": 0.001, "count": 1},
                 "box.high": [-0.03, 1.0, 1.0]}, r"box.high \(x\)", "-0.03", "above", "lower"),
    (COLLISION, {"spheres": [{"radius": 0.001, "position": [0.0, 0.006, 0.0]}]},
     r"spheres\[0\].position \(y\)", "0.006", "inside the box", "move"),
    (COLLISION, {"particles.count": 3}, "particles.radius_mean", None, "particles.count", "mean"),
    (COLLISION, {"particles": {**MATERIAL, "radius_mean": 0.001, "count": 1,
                               "volume_fraction": 0.1}}, "particles.count", "1", "fix", "remove"),
    (COLLISION, {"particles": {**MATERIAL, "radius_mean": 0.001, "radius_deviation": 0.0004}},
     "particles.radius_deviation", "0.0004", "smallest radius", "lower"),
    (COLLISION, {"spheres": [GRAIN]}, "grains", None, "fixed grains", r"\[grains\]"),
    (COLLISION, {"contact.damping_ratio": GONE}, "contact.damping_ratio, contact.restitution",
     None, "exactly one", "give one"),
    (COLLISION, {"contact.restitution": 0.5}, "contact.damping_ratio, contact.restitution",
     "'both given'", "exactly one", "give one"),
    (COLLISION, {"contact.rolling_friction": 0.1}, "contact.rolling_friction", "0.1", "friction",
     "contact.friction above 0"),
    (COLLISION, {"time.step": 0.01}, "time.step", "0.01", "output.samples = 20", "shorten"),
    (COLLISION, {"fluid": {**FLUID, "velocity_outside": "piston"}}, "fluid.velocity_outside",
     "'piston'", "no piston", r"\[piston\]"),
    (COLLISION, {"fluid": {**FLUID, "velocity_outside": "accelerating"}}, "fluid.acceleration",
     None, "no piston", "m/s2"),
    (COLLISION, {"fluid": {**FLUID, "velocity_inside": "pore"}}, "fluid.velocity_inside", "'pore'",
     "no specimen", "still"),
    (INFILTRATION, {"drag": {"scheme": "implicit", "carrier": "addforce"}}, "drag.carrier",
     "'addforce'", "coupling's own", "coupling, or drag.scheme = held"),
    (COLLISION, {"piston.acceleration": 1.0}, "piston.mass", None, "no suspension", "kg"),
    (INFILTRATION, {"box": COLLISION["box"]}, "box", "'given'", "already", "remove"),
    (INFILTRATION, {"grains": GONE}, "grains", None, "fixed grains", r"\[grains\]"),
    (INFILTRATION, {"grains.radius_mean": GONE}, "grains.radius_mean", None, "grains", "mean"),
    (INFILTRATION, {"grains.radius_deviation": 0.002}, "grains.radius_deviation", "0.002", "m", ""),
    (INFILTRATION, {"specimen.permeability_matrix": 1e-10}, "specimen.permeability_matrix",
     "1e-10", "P_2 >= P_1 = 1e-09", "phase 2"),
    (INFILTRATION, {"reservoir.length": GONE}, SUSPENSION, r"\['count'\]", "two of the", "two"),
    (INFILTRATION, {"particles.volume_fraction": 0.1}, SUSPENSION, None, "exactly two", "give two"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("tables", "changes", "name", "value", "bound", "fix"),
    ALONE,
    ids=[f"{'.'.join(case[1])}={next(iter(case[1].values()))}"[:60] for case in ALONE],
)
def test_a_mistake_alone_is_the_only_one(tables, changes, name, value, bound, fix):
    (found,) = mistakes(tables, changes).items()
    assert re.fullmatch(name, found[0])
    if value is not None:
        assert re.fullmatch(value, found[1]["value"])
    assert re.search(bound, found[1]["bound"])
    assert re.search(fix, found[1]["fix"])


def test_all_mistakes_in_one_message():
    found = mistakes(
        INFILTRATION,
        {
            "fluid.viscosity": -1.0,
            "particles.density": GONE,
            "specimen.phi": 2.0,
            "time.duration": "long",
            "piston.speed": 1.0,
        },
    )
    assert set(found) == {
        "fluid.viscosity", "particles.density", "specimen.phi", "time.duration", "piston.speed",
    }  # fmt: skip


def test_all_contradictions_in_one_message():
    found = mistakes(
        INFILTRATION,
        {
            "box": COLLISION["box"],
            "grains.radius_deviation": 0.002,
            "contact.restitution": 0.5,
            "contact.rolling_friction": 0.1,
            "reservoir.length": GONE,
            "fluid.velocity_outside": "accelerating",
            "fluid.acceleration": 1.0,
            "time.step": 0.9,
        },
    )
    assert len(found) == 6
    assert "box" in found
    assert "time.step" in found


@pytest.mark.parametrize(
    ("changes", "name", "near"),
    [
        ({"particles.radius_meen": 0.001}, "particles.radius_meen", "radius_mean"),
        ({"specimin": {}}, "specimin", "specimen"),
        ({"spheres": [{"radius": 1e-3, "position": [0.0, 0.0, 0.0], "mass": 1.0, "spinn": 1.0}]},
         "spheres[0].spinn", "spin"),
    ],
)  # fmt: skip
def test_an_unknown_key_is_shown_the_valid_ones(changes, name, near):
    found = mistakes(COLLISION, changes)[name]
    assert found["bound"] == "there is no such key"
    assert found["fix"].startswith(f"did you mean {near}? valid: ")
    assert near in found["fix"].split("valid: ")[1].split(", ")


def test_an_unknown_key_like_no_other_gets_no_guess():
    assert mistakes(COLLISION, {"particles.qqq": 1})["particles.qqq"]["fix"].startswith("valid: ")


NUMBERS = [
    "particles.density",
    "contact.friction",
    "time.step",
    "specimen.height",
    "fluid.velocity",
]


NO_NUMBERS = [math.nan, math.inf, -math.inf, True, False, "1.0", "", None, [1.0], {}, 10**400]
#: None is the default of these; TOML itself has no null.
OPTIONAL = {"time.step", "specimen.height"}


@pytest.mark.parametrize(
    ("name", "value"),
    [(n, v) for n in NUMBERS for v in NO_NUMBERS if not (v is None and n in OPTIONAL)],
    ids=lambda part: str(part)[:24],
)
def test_only_finite_numbers_pass_for_numbers(name, value):
    assert any(found.startswith(name) for found in mistakes(INFILTRATION, {name: value}))


@pytest.mark.parametrize("value", [True, 1.0, "1", math.nan])
def test_only_whole_numbers_pass_for_counts(value):
    assert "output.samples" in mistakes(COLLISION, {"output.samples": value})


@pytest.mark.parametrize("value", [[0.0, 0.0], [0.0] * 4, [0.0, 0.0, math.nan], "abc", 0.0, {}])
def test_only_three_finite_numbers_pass_for_a_vector(value):
    sphere = {"radius": 0.001, "position": value}
    (name,) = mistakes(COLLISION, {"spheres": [sphere]})
    assert name.startswith("spheres[0].position")


@pytest.mark.parametrize("data", [[], None, 3, "text"], ids=str)
def test_what_is_no_table_is_refused(data):
    with pytest.raises(SceneError):
        make_scene(data)


@pytest.mark.parametrize(
    ("tables", "changes"),
    [
        pytest.param(COLLISION, {"title": "harmless\nshell echo injected"}),
        pytest.param(COLLISION, {"title": "a\rb"}),
        pytest.param(COLLISION, {"title": "\ud800"}),
        pytest.param(COLLISION, {"box.walls": ["x-", "x-"]}),
        pytest.param(
            COLLISION, {"piston": {"acceleration": 1.0, "mass": 1.0}, "box.walls": ["x-"]}
        ),
        pytest.param(COLLISION, {"spheres": []}),
        pytest.param(
            COLLISION, {"spheres": [], "particles": {**MATERIAL, "count": 0, "radius_mean": 0.001}}
        ),
        pytest.param(INFILTRATION, {"particles.count": 10**6}),
        pytest.param(INFILTRATION, {"particles.count": 0}),
        pytest.param(COLLISION, {"spheres": [COLLISION["spheres"][0], COLLISION["spheres"][0]]}),
    ],
    ids=lambda value: str(value)[:50] if isinstance(value, dict) and len(value) < 4 else "",
)
def test_scenes_that_cannot_be_run_are_refused(tables, changes):
    mistakes(tables, changes)


@pytest.mark.parametrize("scheme", ["auto", "exact", "held"])
def test_the_implicit_scheme_alone_needs_the_coupling(scheme):
    drag = {"scheme": scheme, "carrier": "addforce"}
    assert scene_of(INFILTRATION, {"drag": drag}).drag.carrier == "addforce"


def test_a_bad_number_in_a_vector_is_told_its_unit():
    found = mistakes(COLLISION, {"spheres": [{"radius": 1.0, "position": [0.0, 0.0, math.nan]}]})
    assert "[m]" in found["spheres[0].position[2]"]["fix"]


def test_a_scene_never_changes():
    scene = scene_of(COLLISION)
    with pytest.raises(pydantic.ValidationError, match="frozen"):
        scene.seed = 3
    with pytest.raises(pydantic.ValidationError, match="frozen"):
        scene.particles.density = 1.0
    assert isinstance(scene.spheres, tuple)
    assert hash(scene) == hash(scene_of(COLLISION))


def test_contradictions_are_told_beside_the_mistakes_of_single_keys():
    """One message, also where a bad key keeps the scene from being one."""
    changes = {
        "particles.density": GONE,
        "particles.young_modulus": 1e7,
        "particles.youngs_modulus": GONE,
        "contact.restitution": 0.5,
        "contact.damping_ratio": 0.1,
        "contact.rolling_friction": 0.1,
    }
    found = mistakes(COLLISION, changes)
    assert {"particles.density", "particles.young_modulus", "particles.youngs_modulus"} <= set(
        found
    )
    assert "contact.damping_ratio, contact.restitution" in found
    assert "contact.rolling_friction" in found


def test_a_contradiction_that_hangs_on_a_bad_key_is_not_told():
    """Whether the friction is zero cannot be known while it is no number."""
    found = mistakes(COLLISION, {"contact.friction": "much", "contact.rolling_friction": "more"})
    assert set(found) == {"contact.friction", "contact.rolling_friction"}
