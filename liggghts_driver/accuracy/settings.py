"""Settings, the keys that say how a scene is computed; and where a scene has others."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from liggghts_driver.scene.model import Scene

#: The finest settings that a study can afford: half of Eq. 21's step, contacts as stiff as the
#: scene says, and a drag kept for intervals that err by a thousandth at most.
FINEST: Mapping[str, Any] = {
    "time.step_fraction": 0.05,
    "drag.tolerance": 0.001,
    "contact.stiffness_scale": 1.0,
}
#: The largest overlap of a contact in a valid answer: no setting, but it goes with the stiffness.
OVERLAP = "contact.largest_overlap"
#: Keys of which the first, when it is given, takes the place of the second.
_INSTEAD = (("time.step", "time.step_fraction"), ("drag.refresh", "drag.tolerance"))


def rivals(name: str) -> tuple[str, ...]:
    """The keys that settle the same thing as a key, itself among them."""
    return next((pair for pair in _INSTEAD if name in pair), (name,))


def value_of(scene: Scene, name: str) -> Any:
    """What a scene has for a dotted key."""
    table, key = name.split(".")
    return getattr(getattr(scene, table), key)


def overruled(settings: Mapping[str, Any], scene: Scene) -> tuple[str, ...]:
    """The keys by which a scene is computed otherwise than some settings say."""
    return tuple(dict.fromkeys(_overruling(settings, scene)))


def _overruling(settings: Mapping[str, Any], scene: Scene) -> Iterator[str]:
    for name, value in settings.items():
        first, second = rivals(name)[0], rivals(name)[-1]
        if name != first and first in settings:
            continue  # of no effect: the first takes its place
        counts = second if value_of(scene, first) is None else first
        if counts != name or value_of(scene, name) != value:
            yield counts
