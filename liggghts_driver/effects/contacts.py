"""Normal contact forces: bodies that touch repel each other."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from liggghts_driver.effects.base import Effect, Slot, Weight
from liggghts_driver.effects.scales import scales_of
from liggghts_driver.physics.contact import Body, largest_overlap_m, restitution_from_damping_ratio
from liggghts_driver.scene.elastic import elastic

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

    def weigh(self, case: Case) -> Weight:
        """Overlap of two mean particles that meet at the largest speed, over their radius."""
        scales = scales_of(case)
        body = Body(scales.radius_m, scales.mass_kg, *elastic(case.scene, "particles"))
        overlap = largest_overlap_m(body, body, case.speed_bound_m_s)
        return Weight("overlap", "largest overlap over radius", overlap / scales.radius_m)

    def cost(self, case: Case) -> float:  # noqa: ARG002
        """The unit of all costs."""
        return 1.0

    def values(self, case: Case) -> dict[str, object]:
        """Elastic constants of each material, and the restitution."""
        moduli, ratios = zip(*(elastic(case.scene, body) for body in case.materials), strict=True)
        return {
            "youngs_moduli": " ".join(map(repr, moduli)),
            "poissons_ratios": " ".join(map(repr, ratios)),
            "restitution": pairwise(case, restitution(case.scene)),
        }
