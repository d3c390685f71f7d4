"""What effects find wrong with a scene: their own numbers, and effects that exclude others."""

from __future__ import annotations

from typing import TYPE_CHECKING

from liggghts_driver.scene.checks import Mistake

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from liggghts_driver.effects.base import Effect
    from liggghts_driver.scene.model import Scene


def mistaken_settings(scene: Scene, effects: Iterable[Effect]) -> list[Mistake]:
    """Every number that no effect knows, or that is out of its bounds."""
    known = {effect.name: effect for effect in effects if effect.settings}
    mistakes: list[Mistake] = []
    for name, numbers in scene.effects.settings.items():
        if name not in known:
            valid = ", ".join(sorted(known)) or "none in this version"
            key = f"effects.settings.{name}"
            mistakes.append(Mistake(key, "{...}", "no effect has such numbers", f"valid: {valid}"))
        else:
            mistakes += _numbers(known[name], numbers)
    return mistakes


def conflicts(scene: Scene, effects: Iterable[Effect]) -> list[Mistake]:
    """Every two effects of a scene that cannot be in one deck."""
    active = {effect.name: effect for effect in effects if effect.decide(scene)[0]}
    return [
        Mistake(
            f"effect {name}",
            "in",
            f"it cannot be in one deck with {other}",
            f"leave out one: {effect.decide(scene)[1]}; {active[other].decide(scene)[1]}",
        )
        for name, effect in active.items()
        for other in effect.conflicts
        if other in active
    ]


def _numbers(effect: Effect, numbers: Mapping[str, float]) -> Iterator[Mistake]:
    for name, value in numbers.items():
        key = f"effects.settings.{effect.name}.{name}"
        setting = effect.settings.get(name)
        if setting is None:
            fix = f"valid: {', '.join(sorted(effect.settings))}"
            yield Mistake(key, value, "there is no such key", fix)
        elif not setting.at_least <= value <= setting.at_most:
            bound = f"must be from {setting.at_least:g} to {setting.at_most:g}"
            yield Mistake(key, value, bound, f"give the {setting.meaning} [{setting.unit}]")
