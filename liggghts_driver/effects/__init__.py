"""The effects that a scene can call for; a deck holds those that it does and nothing else."""

from __future__ import annotations

from typing import TYPE_CHECKING

from liggghts_driver.effects.base import Column, Decision, Effect
from liggghts_driver.effects.contacts import (
    Contacts,
    FixedGrains,
    Friction,
    RollingResistance,
    Walls,
)
from liggghts_driver.effects.drag import Drag
from liggghts_driver.effects.forces import Buoyancy, Gravity, PressureForce
from liggghts_driver.effects.piston import Piston
from liggghts_driver.effects.rotation import Rotation

if TYPE_CHECKING:
    from liggghts_driver.scene.model import Scene

#: Every effect, in the order of the deck.
EFFECTS: tuple[Effect, ...] = (
    Contacts(),
    Friction(),
    RollingResistance(),
    FixedGrains(),
    Walls(),
    Piston(),
    PressureForce(),
    Drag(),
    Gravity(),
    Buoyancy(),
    Rotation(),
)


def decide_effects(scene: Scene) -> tuple[Decision, ...]:
    """Every effect with the decision for this scene and its reason."""
    return tuple(Decision(effect, *effect.decide(scene)) for effect in EFFECTS)


def active_effects(scene: Scene) -> tuple[Effect, ...]:
    """The effects that a scene calls for."""
    return tuple(decision.effect for decision in decide_effects(scene) if decision.active)


__all__ = ["EFFECTS", "Column", "Decision", "Effect", "active_effects", "decide_effects"]
