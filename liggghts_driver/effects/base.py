"""What an effect is: a piece of physics that a scene calls for or not.

An effect is one object in a file of its own: it decides from the scene whether it is in and says
why, measures its weight in the case, and knows what it needs and what leaving it out means. Its
deck lines stand in ``templates/effects/<name>.j2``; ``values`` gives that fragment its numbers.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal

if TYPE_CHECKING:
    from collections.abc import Mapping

    from liggghts_driver.case import Case
    from liggghts_driver.scene.model import Scene

#: The places of the deck, in its order, at which effects put their lines.
Slot = Literal["materials", "boundaries", "forces", "integration"]


@dataclass(frozen=True)
class Column:
    """A column of the series: its name in our files and the engine's word for it."""

    name: str
    engine: str


@dataclass(frozen=True)
class Refresh:
    """Commands that an effect wants before the run (``once``), and again every so many steps."""

    every: int
    once: tuple[str, ...]
    again: tuple[str, ...]


@dataclass(frozen=True)
class Overlay:
    """A pair style laid over the contacts: its words, and its ``pair_coeff`` lines."""

    style: str
    coefficients: tuple[str, ...]


@dataclass(frozen=True)
class Weight:
    """How much an effect counts in a case.

    Attributes
    ----------
    number, meaning
        Name of the dimensionless number, and what is over what in it.
    value
        Its value.
    share
        Estimated relative change of the particles' motion when the effect is left out, 0 to 1;
        None where leaving it out is no approximation but another problem.
    """

    number: str
    meaning: str
    value: float
    share: float | None = None


@dataclass(frozen=True)
class Setting:
    """A number of an effect, ``[effects.settings.<effect>]`` in the scene; default 0."""

    unit: str
    meaning: str
    at_least: float = 0.0
    at_most: float = math.inf


@dataclass(frozen=True)
class Decision:
    """An effect of a scene: in or out, and why."""

    effect: Effect
    active: bool
    reason: str


class Effect(ABC):
    """One piece of physics."""

    name: ClassVar[str]
    title: ClassVar[str]
    slot: ClassVar[Slot]
    #: Its place among those of its slot.
    order: ClassVar[int] = 0
    #: Words of this effect in the engine's contact model, e.g. ``("tangential", "history")``.
    contact_words: ClassVar[tuple[str, ...]] = ()
    #: Names of effects without which it is nothing.
    needs: ClassVar[tuple[str, ...]] = ()
    #: Names of effects that cannot be in the same deck.
    conflicts: ClassVar[tuple[str, ...]] = ()
    #: Its own numbers, for an effect that has no table in the scene's model.
    settings: ClassVar[Mapping[str, Setting]] = {}
    #: Keys of the scene, and their values, with which it is out; None where the problem needs it.
    without: ClassVar[Mapping[str, Any] | None] = None

    @abstractmethod
    def decide(self, scene: Scene) -> tuple[bool, str]:
        """Whether the scene calls for it, and why."""

    def setting(self, scene: Scene, name: str) -> float:
        """One of its own numbers, as the scene gives it; 0 if it does not."""
        assert name in self.settings
        return scene.effects.settings.get(self.name, {}).get(name, 0.0)

    @abstractmethod
    def weigh(self, case: Case) -> Weight:
        """Its dimensionless number in a case that it is in."""

    def cost(self, case: Case) -> float:  # noqa: ARG002
        """Time that it adds to a step, over the time of the contacts alone; see ``costs``."""
        return 0.0

    def fragment(self, case: Case) -> str:  # noqa: ARG002
        """Its template."""
        return f"effects/{self.name}.j2"

    def values(self, case: Case) -> dict[str, object]:  # noqa: ARG002
        """Numbers and texts for the effect's fragment of the deck."""
        return {}

    def overlay(self, case: Case) -> Overlay | None:  # noqa: ARG002
        """The pair style that it lays over the contacts; None for most."""
        return None

    def columns(self, case: Case) -> tuple[Column, ...]:  # noqa: ARG002
        """Columns that the effect adds to the series."""
        return ()

    def refresh(self, case: Case) -> Refresh | None:  # noqa: ARG002
        """What the effect renews while the engine runs; None when nothing."""
        return None
