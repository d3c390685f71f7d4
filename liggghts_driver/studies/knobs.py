"""The settings that trade accuracy for time: one knob turned at a time, and some together."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from liggghts_driver.accuracy import FINEST
from liggghts_driver.scene.layout import layout, particle_count
from liggghts_driver.sweeps.draft import scene_with

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from liggghts_driver.scene.model import Scene

#: How far contacts overlap is measured here: no run is stopped for it.
_UNJUDGED: Mapping[str, Any] = {"contact.largest_overlap": 1.0}
_STEP_FRACTIONS = (0.1, 0.2, 0.4, 0.8)
#: Of a drag kept until its error may be this: coarser than what other bounds allow.
_TOLERANCE = 0.02
_SCALES = (0.1, 0.01, 0.001)
#: Shares of the cross-section.
_SECTIONS = (0.5, 0.25)
#: Several knobs at once, with the coarser drag: step fraction, scale, share of the cross-section.
_TOGETHER = ((0.1, 0.1, 1.0), (0.2, 0.1, 1.0), (0.4, 0.1, 1.0), (0.2, 0.01, 1.0),
             (0.4, 0.01, 1.0), (0.8, 0.01, 1.0), (0.4, 0.001, 1.0),
             (0.4, 0.01, 0.5), (0.4, 0.01, 0.25))  # fmt: skip


@dataclass(frozen=True, eq=False)
class Setting:
    """One way of simulating a scene.

    Attributes
    ----------
    knob
        What is turned: ``reference``, ``step``, ``drag``, ``stiffness``, ``section`` or
        ``together``.
    value
        Where it stands; nan where several are turned.
    title
        For people.
    changes
        Keys of the scene that differ from the reference's.
    order
        The order that is expected of the error in ``value``; None where none is.
    """

    knob: str
    value: float
    title: str
    changes: Mapping[str, Any] = field(default_factory=dict)
    order: float | None = None

    def scene(self, scene: Scene, seed: int) -> Scene:
        """A scene simulated in this way.

        Raises
        ------
        SceneError
            If the scene cannot be.
        """
        tables = scene.model_dump(mode="json", exclude_none=True)
        tables["time"].pop("step", None)
        tables.get("drag", {}).pop("refresh", None)
        changes = {**FINEST, **_UNJUDGED, **self.changes, "seed": seed}
        return scene_with(tables, changes, self.title)


REFERENCE = Setting("reference", math.nan, "reference")


#: What can be turned.
KNOBS = ("step", "drag", "stiffness", "section", "together")


def settings_of(scene: Scene) -> tuple[Setting, ...]:
    """The reference, then each knob of a scene turned alone, then some of them together."""
    return (REFERENCE, *_alone(scene), *_together(scene))


def _alone(scene: Scene) -> Iterator[Setting]:
    for fraction in _STEP_FRACTIONS:
        title = f"step {fraction:g}"
        # Of a damped collision the restitution is of first order in the step.
        yield Setting("step", fraction, title, {"time.step_fraction": fraction}, 1.0)
    if scene.dragging_fluid is not None:
        yield from _drags(scene)
    for scale in _SCALES:
        # Overlaps of a given speed go with the modulus to the power -2/5.
        changes = {"contact.stiffness_scale": scale}
        yield Setting("stiffness", scale, f"stiffness x {scale:g}", changes, -0.4)
    if scene.specimen is not None:
        for share in _SECTIONS:
            yield Setting("section", share, f"{share:g} of the section", smaller(scene, share))


def _drags(scene: Scene) -> Iterator[Setting]:
    """The drag kept for longer, and the other scheme that a scene can afford.

    The exact scheme is not among them: it costs tens of times as much as the contacts.
    """
    tolerance = {"drag.tolerance": _TOLERANCE}
    # The interval goes with the root of the tolerance, the error of a velocity with its square.
    yield Setting("drag", _TOLERANCE, f"drag to {100 * _TOLERANCE:g} %", tolerance, 1.0)
    longest = scene.time.duration / scene.output.samples
    if scene.drag.carrier == "coupling":
        yield Setting("drag", math.nan, "drag implicit", {"drag.scheme": "implicit"})
        kept = {"drag.scheme": "implicit", "drag.refresh": longest}
        yield Setting("drag", math.nan, f"drag implicit, kept {longest:.3g} s", kept, 2.0)


def _together(scene: Scene) -> Iterator[Setting]:
    for fraction, scale, share in _TOGETHER:
        if share < 1.0 and scene.specimen is None:
            continue
        title = f"step {fraction:g}, stiffness x {scale:g}"
        changes = {"time.step_fraction": fraction, "contact.stiffness_scale": scale}
        if scene.dragging_fluid is not None:
            changes["drag.tolerance"] = _TOLERANCE
            title += f", drag to {100 * _TOLERANCE:g} %"
        if share < 1.0:
            title += f", {share:g} of the section"
            changes |= smaller(scene, share)
        yield Setting("together", math.nan, title, changes)


def smaller(scene: Scene, share: float) -> dict[str, Any]:
    """Keys with which a scene has a share of its cross-section, and as many particles per area."""
    assert scene.specimen is not None
    specimen, side = scene.specimen, math.sqrt(share)
    changes: dict[str, Any] = {"specimen.width": specimen.width * side}
    if specimen.height is not None:
        changes["specimen.height"] = specimen.height * side
    if scene.particles.count is not None:
        changes["particles.count"] = round(particle_count(scene, layout(scene)) * share)
    if scene.piston is not None and scene.piston.mass is not None:
        changes["piston.mass"] = scene.piston.mass * share
    return changes
