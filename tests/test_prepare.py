"""Screening: what is too weak is left out, is named, and nothing else changes."""

from __future__ import annotations

import pytest
from small_scenes import COLLISION, FLUID, INFILTRATION, changed, scene_of

from liggghts_driver.effects import EFFECTS, active_effects
from liggghts_driver.errors import SceneError
from liggghts_driver.explain import explain_case
from liggghts_driver.identity import scene_hash
from liggghts_driver.prepare import decisions_of, prepare, weak_effects, without

#: A hair of gravity: 1e-4 of the pressure force's acceleration, 1.5 x 10 Pa/m / 7000 kg/m3.
FAINT = {"acceleration": [0.0, 0.0, -2.143e-7]}
BY_NAME = {effect.name: effect for effect in EFFECTS}


def names(case) -> set[str]:
    return {effect.name for effect in active_effects(case.scene)}


def test_nothing_is_screened_unless_asked_for():
    case = prepare(scene_of(INFILTRATION, {"gravity": FAINT}))
    assert case.screened == ()
    assert {"gravity", "buoyancy"} <= names(case)
    assert case.identity is case.scene


def test_the_faint_is_left_out_and_named():
    asked = scene_of(INFILTRATION, {"gravity": FAINT, "effects.screen": 0.01})
    case = prepare(asked)
    assert set(case.screened) == {"gravity", "buoyancy"}
    assert names(case) == names(prepare(scene_of(INFILTRATION)))
    # The run is known by the scene that asked.
    assert scene_hash(case.identity) == scene_hash(asked)
    reasons = {d.effect.name: d.reason for d in decisions_of(case)}
    assert "effects.screen = 0.01" in reasons["gravity"]
    assert "effects.screen" not in reasons["friction"]
    rows = {row["name"]: row for row in explain_case(case)["effects"]}
    assert rows["gravity"]["screened"]
    assert not rows["friction"]["screened"]


def test_the_limit_decides():
    # The gravity number is its weight, less buoyancy, over the pressure force: 5/7 x 1e-4.
    scene = scene_of(INFILTRATION, {"gravity": FAINT})
    (share,) = [
        effect.weigh(prepare(scene)).share for effect in EFFECTS if effect.name == "gravity"
    ]
    assert share == pytest.approx(5.0 / 7.0 * 1e-4, rel=2e-4)  # 2.143 has four digits
    for factor, left_out in ((1.1, True), (0.9, False)):
        changes = {"gravity": FAINT, "effects.screen": factor * share}
        case = prepare(scene_of(INFILTRATION, changes))
        assert ("gravity" in case.screened) == left_out


def test_what_drives_the_paper_is_never_weak():
    changes = {"effects.screen": 0.99, "contact.friction": 1.0}
    case = prepare(scene_of(INFILTRATION, changes))
    assert case.screened == ()
    assert {"pressure", "drag", "piston", "friction"} <= names(case)


def test_screening_changes_nothing_but_the_effect():
    screened = prepare(scene_of(INFILTRATION, {"gravity": FAINT, "effects.screen": 0.01}))
    plain = prepare(scene_of(INFILTRATION))
    assert (screened.population.centres_m == plain.population.centres_m).all()
    assert screened.time == plain.time


@pytest.mark.parametrize("name", [e.name for e in EFFECTS if e.without is not None])
def test_without_leaves_an_effect_out(name):
    """Its keys do what they say, and of the others only those go that need it."""
    scene = scene_of(
        INFILTRATION,
        {
            "gravity": {"acceleration": [0.0, 0.0, -9.81]},
            "contact.friction": 0.3,
            "contact.rolling_friction": 0.05,
            "contact.cohesion_energy_density": 10.0,
            "near_field": {"force": 1e-6, "reach": 5e-4},
        },
    )
    before = {effect.name for effect in active_effects(scene)}
    assert name in before
    after = {effect.name for effect in active_effects(without(scene, [BY_NAME[name]]))}
    follow = {other for other in before if name in BY_NAME[other].needs}
    # A fluid without drag still buoys.
    assert before - after == {name} | follow


@pytest.mark.parametrize("name", [e.name for e in EFFECTS if e.without is None])
def test_what_the_problem_needs_cannot_be_left_out(name):
    with pytest.raises(ValueError, match=name):
        without(scene_of(INFILTRATION), [BY_NAME[name]])


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"contact.friction": 0.3},
        {"contact.friction": 0.3, "contact.rolling_friction": 0.05},
        {"gravity": FAINT},
        {"gravity": FAINT, "fluid": FLUID},
    ],
    ids=str,
)
def test_needs_are_there_whenever_an_effect_is(changes):
    active = active_effects(scene_of(COLLISION, changes))
    here = {effect.name for effect in active}
    assert all(set(effect.needs) <= here for effect in active)


def test_every_weight_is_a_number_with_a_meaning():
    for tables in (COLLISION, changed(INFILTRATION, {"gravity": FAINT, "contact.friction": 0.1})):
        case = prepare(scene_of(tables))
        for effect in active_effects(case.scene):
            weight = effect.weigh(case)
            assert weight.number
            assert weight.meaning
            assert weight.value >= 0.0
            assert weight.share is None or 0.0 <= weight.share <= 1.0
            assert (weight.share is None) == (effect.without is None) or effect.name == "rotation"
            assert effect.cost(case) >= 0.0


def test_weak_effects_are_those_that_may_be_left_out():
    case = prepare(scene_of(INFILTRATION, {"gravity": FAINT}))
    assert weak_effects(case) == ()


@pytest.mark.parametrize("screen", [-0.1, 1.0, "much"])
def test_a_screen_out_of_bounds_is_refused(screen):
    with pytest.raises(SceneError, match=r"effects\.screen"):
        scene_of(COLLISION, {"effects.screen": screen})


def test_settings_of_no_effect_are_refused():
    with pytest.raises(SceneError, match=r"effects\.settings\.magnet.*no effect"):
        scene_of(COLLISION, {"effects.settings": {"magnet": {"field": 1.0}}})
