"""Bodies that touch: the contact law, its friction, and the walls."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from liggghts_driver.effects.base import Effect, Slot
from liggghts_driver.physics.contact import restitution_from_damping_ratio
from liggghts_driver.timestep import wall_stiffness

if TYPE_CHECKING:
    from liggghts_driver.case import Case
    from liggghts_driver.scene.model import Scene


def restitution(scene: Scene) -> float:
    """Coefficient of restitution: as given, or from the paper's damping ratio."""
    if scene.contact.restitution is not None:
        return scene.contact.restitution
    assert scene.contact.damping_ratio is not None
    return restitution_from_damping_ratio(scene.contact.damping_ratio)


def pairwise(case: Case, value: float) -> str:
    """One value for every pair of materials, as the engine's peratomtypepair wants it."""
    count = len(case.materials)
    return " ".join([str(count)] + [f"{value!r}"] * count**2)


class Contacts(Effect):
    """Normal contact forces: Hertz with Tsuji damping."""

    name: ClassVar[str] = "contacts"
    title: ClassVar[str] = "Hertz contacts"
    slot: ClassVar[Slot] = "materials"
    contact_words: ClassVar[tuple[str, ...]] = ("model", "hertz")

    def decide(self, scene: Scene) -> tuple[bool, str]:  # noqa: ARG002
        """Always in: the engine has no particles without a contact law."""
        return True, "bodies that touch repel each other"

    def values(self, case: Case) -> dict[str, object]:
        """Elastic constants of each material, and the restitution."""
        scene = case.scene
        elastic = {
            "particles": (scene.particles.youngs_modulus, scene.particles.poissons_ratio),
            "walls": wall_stiffness(scene),
        }
        if scene.grains is not None:
            elastic["grains"] = (scene.grains.youngs_modulus, scene.grains.poissons_ratio)
        moduli = [elastic[name][0] for name in case.materials]
        ratios = [elastic[name][1] for name in case.materials]
        return {
            "youngs_moduli": " ".join(map(repr, moduli)),
            "poissons_ratios": " ".join(map(repr, ratios)),
            "restitution": pairwise(case, restitution(scene)),
        }


class Friction(Effect):
    """Tangential forces: a spring with history that slips at Coulomb's limit."""

    name: ClassVar[str] = "friction"
    title: ClassVar[str] = "tangential friction"
    slot: ClassVar[Slot] = "materials"
    contact_words: ClassVar[tuple[str, ...]] = ("tangential", "history")

    def decide(self, scene: Scene) -> tuple[bool, str]:
        """In when the friction coefficient is above zero."""
        mu = scene.contact.friction
        if mu > 0:
            return True, f"friction coefficient {mu:g}"
        return False, "friction = 0: no tangential force, so no contact history"

    def values(self, case: Case) -> dict[str, object]:
        """The coefficient for every pair of materials."""
        return {"coefficient": pairwise(case, case.scene.contact.friction)}


class RollingResistance(Effect):
    """Rolling resistance, the engine's elastic-plastic spring-dashpot model (epsd2)."""

    name: ClassVar[str] = "rolling"
    title: ClassVar[str] = "rolling resistance"
    slot: ClassVar[Slot] = "materials"
    contact_words: ClassVar[tuple[str, ...]] = ("rolling_friction", "epsd2")

    def decide(self, scene: Scene) -> tuple[bool, str]:
        """In when the rolling resistance coefficient is above zero."""
        mu = scene.contact.rolling_friction
        if mu > 0:
            return True, f"rolling resistance coefficient {mu:g}"
        return False, "rolling_friction = 0: no resisting torque"

    def values(self, case: Case) -> dict[str, object]:
        """The coefficient for every pair of materials."""
        return {"coefficient": pairwise(case, case.scene.contact.rolling_friction)}


class FixedGrains(Effect):
    """Grains that never move."""

    name: ClassVar[str] = "grains"
    title: ClassVar[str] = "fixed grains"
    slot: ClassVar[Slot] = "boundaries"

    def decide(self, scene: Scene) -> tuple[bool, str]:
        """In when the scene has a specimen or single grains."""
        if scene.specimen is not None:
            return True, "the specimen is made of them"
        if any(sphere.kind == "grain" for sphere in scene.spheres):
            return True, "the scene has fixed spheres"
        return False, "no specimen and no fixed sphere"


class Walls(Effect):
    """Plane walls."""

    name: ClassVar[str] = "walls"
    title: ClassVar[str] = "walls"
    slot: ClassVar[Slot] = "boundaries"

    def decide(self, scene: Scene) -> tuple[bool, str]:
        """In when a face of the domain is a wall."""
        if scene.specimen is not None:
            return True, "the specimen and the channel before it are enclosed"
        if scene.box is not None and scene.box.walls:
            return True, f"box.walls = {', '.join(scene.box.walls)}"
        return False, "no face of the box is a wall"

    def values(self, case: Case) -> dict[str, object]:
        """The planes: axis, place and name of each."""
        planes = []
        for face in case.layout.walls:
            axis = "xyz".index(face[0])
            corner = case.layout.low if face[1] == "-" else case.layout.high
            side = "low" if face[1] == "-" else "high"
            planes.append({"axis": face[0], "at": corner[axis], "name": f"wall_{face[0]}_{side}"})
        return {"planes": planes, "type": case.type_of("walls")}
