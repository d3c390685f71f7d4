"""The effects that a scene can call for; a deck holds those that it does and nothing else."""

from __future__ import annotations

from typing import TYPE_CHECKING

from liggghts_driver.effects.base import Column, Decision, Effect, Weight
from liggghts_driver.effects.registry import find_effects
from liggghts_driver.effects.settings import conflicts, mistaken_settings

if TYPE_CHECKING:
    from liggghts_driver.scene.checks import Mistake
    from liggghts_driver.scene.model import Scene

#: Every effect, in the order of the deck: one file of this package each.
EFFECTS: tuple[Effect, ...] = find_effects(__name__, __path__)


def decide_effects(scene: Scene) -> tuple[Decision, ...]:
    """Every effect with the decision for this scene and its reason."""
    return tuple(Decision(effect, *effect.decide(scene)) for effect in EFFECTS)


def active_effects(scene: Scene) -> tuple[Effect, ...]:
    """The effects that a scene calls for."""
    return tuple(decision.effect for decision in decide_effects(scene) if decision.active)


def effect_mistakes(scene: Scene) -> list[Mistake]:
    """Numbers that no effect knows or that are out of bounds, and effects that exclude others."""
    return mistaken_settings(scene, EFFECTS) or conflicts(scene, EFFECTS)


__all__ = [
    "EFFECTS",
    "Column",
    "Decision",
    "Effect",
    "Weight",
    "active_effects",
    "decide_effects",
    "effect_mistakes",
]
