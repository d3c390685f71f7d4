"""The settings that trade accuracy for time: one knob turned at a time, and some together."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from liggghts_driver.scene.layout import layout, particle_count
from liggghts_driver.sweeps.draft import scene_with

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
_STEP_FRACTIONS = (0.1, 0.2, 0.4)
_TOLERANCES = (0.005, 0.02, 0.08)
_SCALES = (0.1, 0.01, 0.001)
#: Shares of the cross-section.
_SECTIONS = (0.5, 0.25)
#: Several knobs at once: step fraction, tolerance, scale, share of the cross-section.
_TOGETHER = ((0.1, 0.005, 0.1, 1.0), (0.2, 0.02, 0.1, 1.0), (0.2, 0.02, 0.01, 1.0),
             (0.4, 0.02, 0.01, 1.0), (0.2, 0.02, 0.1, 0.5))  # fmt: skip


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
        return scene_with(tables, {**FINEST, **self.changes, "seed": seed}, self.title)


REFERENCE = Setting("reference", math.nan, "reference")


def settings_of(scene: Scene) -> tuple[Setting, ...]:
    """The reference, then each knob of a scene turned alone, then some of them together."""
    return (REFERENCE, *_alone(scene), *_together(scene))


def _alone(scene: Scene) -> Iterator[Setting]:
    for fraction in _STEP_FRACTIONS:
        title = f"step {fraction:g} of a contact"
        # Of a frictionless collision the restitution is of first order in the step.
        yield Setting("step", fraction, title, {"time.step_fraction": fraction}, 1.0)
    if scene.dragging_fluid is not None:
        for tolerance in _TOLERANCES:
            title = f"drag to {100 * tolerance:g} %"
            # The interval goes with the root of the tolerance, the error with its square.
            yield Setting("drag", tolerance, title, {"drag.tolerance": tolerance}, 1.0)
    for scale in _SCALES:
        title = f"stiffness x {scale:g}"
        # Overlaps of a given force go with the modulus to the power -2/3.
        yield Setting("stiffness", scale, title, {"contact.stiffness_scale": scale}, -2.0 / 3.0)
    if scene.specimen is not None:
        for share in _SECTIONS:
            yield Setting("section", share, f"{share:g} of the section", smaller(scene, share))


def _together(scene: Scene) -> Iterator[Setting]:
    for fraction, tolerance, scale, share in _TOGETHER:
        if share < 1.0 and scene.specimen is None:
            continue
        title = f"step {fraction:g}, stiffness x {scale:g}"
        changes = {"time.step_fraction": fraction, "contact.stiffness_scale": scale}
        if scene.dragging_fluid is not None:
            title += f", drag to {100 * tolerance:g} %"
            changes["drag.tolerance"] = tolerance
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
