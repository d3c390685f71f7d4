"""A scene made ready to run: its case, without the effects that it asks to have left out."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from liggghts_driver.case import Case, make_case
from liggghts_driver.effects import Decision, active_effects, decide_effects
from liggghts_driver.scene import make_scene

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from liggghts_driver.effects import Effect
    from liggghts_driver.scene.model import Scene


def prepare(scene: Scene) -> Case:
    """Place the spheres, choose the step, and leave out what ``effects.screen`` says is too weak.

    An effect is left out when its estimated share of the particles' motion (``Weight.share``) is
    below ``effects.screen``; the run is still known by the scene that asked for it.

    Raises
    ------
    PackingError
        If the spheres cannot be placed.
    SceneError
        If the step asked for is above a bound.
    """
    case = make_case(scene)
    weak = weak_effects(case)
    if not weak:
        return case
    names = tuple(effect.name for effect in weak)
    return replace(make_case(without(scene, weak)), screened=names, asked=scene)


def decisions_of(case: Case) -> tuple[Decision, ...]:
    """Every effect, in or out and why, in a case from which some may have been screened."""
    limit = case.identity.effects.screen
    why = f"too weak: its estimated share of the motion is below effects.screen = {limit:g}"
    return tuple(
        replace(decision, reason=why) if decision.effect.name in case.screened else decision
        for decision in decide_effects(case.scene)
    )


def weak_effects(case: Case) -> tuple[Effect, ...]:
    """The effects of a case that its ``effects.screen`` leaves out."""
    limit = case.scene.effects.screen
    if limit == 0.0:
        return ()
    return tuple(
        effect
        for effect in active_effects(case.scene)
        if effect.without is not None and (effect.weigh(case).share or 0.0) < limit
    )


def without(scene: Scene, effects: Iterable[Effect]) -> Scene:
    """The scene with the keys of these effects set so that they are out.

    Raises
    ------
    ValueError
        If the problem needs one of them: it knows no keys with which it is out.
    """
    tables = scene.model_dump(mode="json", exclude_none=True)
    for effect in effects:
        if effect.without is None:
            raise ValueError(f"the scene is another problem without {effect.name}")
        for name, value in effect.without.items():
            _put(tables, name.split("."), value)
    return make_scene(tables, scene.title or "scene")


def _put(tables: dict[str, Any], path: list[str], value: Any) -> None:
    *parents, last = path
    place: Mapping[str, Any] | dict[str, Any] = tables
    for parent in parents:
        if parent not in place:
            return  # the table went with another effect, and this one with it
        place = place[parent]
    assert isinstance(place, dict)
    if value is None:
        del place[last]
    else:
        place[last] = value
