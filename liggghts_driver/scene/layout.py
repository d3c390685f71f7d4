"""Where things stand: the geometry that follows from a scene.

The flow goes along +x. A specimen fills x in [0, length]; the reservoir lies before it, an open
exit leads into a chamber of the specimen's own length behind it, so that nothing ever leaves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from liggghts_driver.errors import PackingError
from liggghts_driver.packing.radii import mean_sphere_volume

if TYPE_CHECKING:
    from liggghts_driver.scene.fields import Face
    from liggghts_driver.scene.model import Radii, Scene

#: More would not fit into the memory of most machines while they are placed.
MOST_SPHERES = 10_000_000
FACES: tuple[Face, ...] = ("x-", "x+", "y-", "y+", "z-", "z+")


@dataclass(frozen=True)
class Layout:
    """The channel [m]: its corners, its walls and the planes that matter.

    ``low`` and ``high`` bound the space in which particles move; ``fill_low`` and ``fill_high``
    the part of it that the suspension fills at the start. ``sections`` are the planes through
    which flow is counted, name to x.
    """

    low: tuple[float, float, float]
    high: tuple[float, float, float]
    fill_low: tuple[float, float, float]
    fill_high: tuple[float, float, float]
    walls: tuple[Face, ...]
    sections: dict[str, float]

    @property
    def area_m2(self) -> float:
        """Cross-section of the channel normal to x."""
        return (self.high[1] - self.low[1]) * (self.high[2] - self.low[2])


def mean_particle_volume_m3(radii: Radii) -> float:
    """Expected volume of one sphere of a distribution; 0 when the scene gives none."""
    if radii.radius_mean is None:
        return 0.0
    return mean_sphere_volume(radii.radius_mean, radii.radius_deviation, radii.radius_truncation)


def particle_count(scene: Scene, layout: Layout) -> int:
    """Particles to place: as said, or from the volume fraction of what the suspension fills.

    Raises
    ------
    PackingError
        If they are too many to be placed, or a fraction is asked for and not one particle fits.
    """
    particles = scene.particles
    if particles.count is not None:
        require_placeable(particles.count, "particles", "particles.count")
        return particles.count
    if particles.volume_fraction is None or particles.radius_mean is None:
        return 0
    volume_m3 = math.prod(b - a for a, b in zip(layout.fill_low, layout.fill_high, strict=True))
    expected = expected_count(particles, particles.volume_fraction * volume_m3)
    require_placeable(expected, "particles", "the reservoir or the box, or particles.radius_mean")
    if particles.volume_fraction > 0.0 and round(expected) == 0:
        raise PackingError(
            f"particles.volume_fraction = {particles.volume_fraction:g} of {volume_m3:.3g} m3 is "
            f"less than one particle of {mean_particle_volume_m3(particles):.3g} m3; make the "
            "reservoir longer or the particles smaller, or give particles.count"
        )
    return round(expected)


def expected_count(radii: Radii, volume_m3: float) -> float:
    """How many spheres of a distribution have a volume together; infinite if one has none."""
    one_m3 = mean_particle_volume_m3(radii)
    return volume_m3 / one_m3 if one_m3 else math.inf


def require_placeable(expected: float, what: str, keys: str) -> None:
    """Refuse more spheres than anyone could place, before memory runs out.

    Raises
    ------
    PackingError
        Naming the keys that say how many there are.
    """
    if not expected <= MOST_SPHERES:
        raise PackingError(
            f"{expected:.3g} {what}: at most {MOST_SPHERES:,} can be placed; change {keys}"
        )


def moving_count(scene: Scene, layout: Layout) -> int:
    """All particles: those to place, and those that the scene places one by one."""
    singles = sum(sphere.kind == "particle" for sphere in scene.spheres)
    return particle_count(scene, layout) + singles


def particle_fraction(scene: Scene, layout: Layout) -> float:
    """Volume fraction v_p of the particles in the suspension at the start."""
    if scene.particles.volume_fraction is not None:
        return scene.particles.volume_fraction
    sides = [b - a for a, b in zip(layout.fill_low, layout.fill_high, strict=True)]
    volume = particle_count(scene, layout) * mean_particle_volume_m3(scene.particles)
    return volume / math.prod(sides)


def layout(scene: Scene) -> Layout:
    """Geometry of a checked scene."""
    return _channel(scene) if scene.specimen is not None else _box(scene)


def _channel(scene: Scene) -> Layout:
    specimen = scene.specimen
    assert specimen is not None
    half_y, half_z = specimen.width / 2, (specimen.height or specimen.width) / 2
    start = -_reservoir_length_m(scene, 4 * half_y * half_z)
    closed = specimen.exit == "closed"
    end = specimen.length if closed else 2 * specimen.length
    # An open exit leads into a chamber whose far end is closed, so that every particle is kept.
    walls = tuple(face for face in FACES if not (face == "x-" and scene.piston))
    return Layout(
        low=(start, -half_y, -half_z),
        high=(end, half_y, half_z),
        fill_low=(start, -half_y, -half_z),
        fill_high=(0.0, half_y, half_z),
        walls=walls,
        sections={"entrance": 0.0, "middle": specimen.length / 2},
    )


def _reservoir_length_m(scene: Scene, area_m2: float) -> float:
    if scene.reservoir.length is not None:
        return scene.reservoir.length
    particles = scene.particles
    if particles.count is None or particles.volume_fraction is None:
        return 0.0
    volume = particles.count * mean_particle_volume_m3(particles)
    return volume / (particles.volume_fraction * area_m2)


def _box(scene: Scene) -> Layout:
    assert scene.box is not None
    low, high = scene.box.low, scene.box.high
    fill_end = high[0] if scene.reservoir.length is None else low[0] + scene.reservoir.length
    return Layout(
        low=low,
        high=high,
        fill_low=low,
        fill_high=(fill_end, high[1], high[2]),
        walls=scene.box.walls,
        sections={},
    )
