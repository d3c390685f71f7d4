"""All effects: every class derived from ``Effect`` in a module of this package."""

from __future__ import annotations

import importlib
import pkgutil
from typing import TYPE_CHECKING

from liggghts_driver.effects.base import Effect

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

_SLOTS = ("materials", "boundaries", "forces", "integration")


def find_effects(package: str, paths: Iterable[str]) -> tuple[Effect, ...]:
    """One object of every effect in the modules of a package, in the order of the deck.

    Raises
    ------
    ValueError
        If two effects have one name, or one names another that does not exist.
    """
    found = [effect() for effect in _classes(package, paths)]
    names = [effect.name for effect in found]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ValueError(f"more than one effect is called {', '.join(twice)}")
    for effect in found:
        unknown = {*effect.needs, *effect.conflicts} - set(names)
        if unknown:
            raise ValueError(f"effect {effect.name} names unknown {', '.join(sorted(unknown))}")
    return tuple(sorted(found, key=lambda e: (_SLOTS.index(e.slot), e.order, e.name)))


def _classes(package: str, paths: Iterable[str]) -> Iterator[type[Effect]]:
    for module in pkgutil.iter_modules(paths):
        contents = vars(importlib.import_module(f"{package}.{module.name}")).values()
        for thing in contents:
            own = isinstance(thing, type) and thing.__module__ == f"{package}.{module.name}"
            if own and issubclass(thing, Effect) and thing is not Effect:
                yield thing
