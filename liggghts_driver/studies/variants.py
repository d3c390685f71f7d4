"""The variants of a scene in a study of its effects: the whole of it, and each effect left out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from liggghts_driver.effects import active_effects
from liggghts_driver.prepare import without

if TYPE_CHECKING:
    from collections.abc import Iterable

    from liggghts_driver.effects import Effect
    from liggghts_driver.scene.model import Scene

#: Name of the variant that all others are compared with.
BASE = "all-effects"


@dataclass(frozen=True)
class Variant:
    """A scene with one effect left out, or with none.

    Attributes
    ----------
    effect
        What is left out; None for the whole scene.
    follows
        Active effects that are nothing without it, and go with it.
    """

    effect: Effect | None = None
    follows: tuple[Effect, ...] = ()

    @property
    def name(self) -> str:
        """As its folder is called."""
        return BASE if self.effect is None else f"without-{self.effect.name}"

    @property
    def title(self) -> str:
        """As people call it."""
        return "all effects" if self.effect is None else f"without {self.effect.title}"

    @property
    def left_out(self) -> tuple[Effect, ...]:
        """Every effect that this variant lacks."""
        return () if self.effect is None else (self.effect, *self.follows)

    def scene(self, scene: Scene, seed: int) -> Scene:
        """A scene in this variant, with a seed of its own.

        Nothing is screened: what the study leaves out is what it says, and nothing else.

        Raises
        ------
        SceneError
            If the scene without the effect contradicts itself.
        """
        effects = scene.effects.model_copy(update={"screen": 0.0})
        seeded = scene.model_copy(update={"seed": seed, "effects": effects})
        return seeded if self.effect is None else without(seeded, [self.effect])


#: Nothing left out.
WHOLE = Variant()


def variants_of(scene: Scene) -> tuple[Variant, ...]:
    """The whole scene first, then each of its effects left out that can be, in the deck's order."""
    active = active_effects(scene)
    return (
        WHOLE,
        *(
            Variant(effect, followers(effect, active))
            for effect in active
            if effect.without is not None
        ),
    )


def followers(effect: Effect, active: Iterable[Effect]) -> tuple[Effect, ...]:
    """The active effects that need this one, or need one that does."""
    others = [other for other in active if other is not effect]
    gone = {effect.name}
    while found := {other.name for other in others if gone & set(other.needs)} - gone:
        gone |= found
    return tuple(other for other in others if other.name in gone)
