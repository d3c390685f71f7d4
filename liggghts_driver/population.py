"""All spheres of a scene: who they are, where they start, and how many of those asked for."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.packing import (
    Spheres,
    cached_packing,
    cut_specimen,
    place_spheres,
    sample_radii,
)
from liggghts_driver.physics.spheres import sphere_volume_m3
from liggghts_driver.scene.layout import (
    Layout,
    expected_count,
    moving_count,
    particle_count,
    require_placeable,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from liggghts_driver.packing.cache import JSON
    from liggghts_driver.scene.model import Scene


@dataclass(frozen=True)
class Population:
    """Particles first, then grains; the row is the engine's atom id minus one.

    Attributes
    ----------
    centres_m, velocities_m_s, spins_rad_s
        ``(n, 3)`` each.
    radii_m
        ``(n,)``.
    particles
        How many of the rows are particles.
    asked
        How many particles the scene asked for.
    solid_fraction
        Measured volume fraction of the grains inside the specimen; nan without one.
    """

    centres_m: NDArray[np.float64]
    radii_m: NDArray[np.float64]
    velocities_m_s: NDArray[np.float64]
    spins_rad_s: NDArray[np.float64]
    particles: int
    asked: int
    solid_fraction: float

    @property
    def grains(self) -> int:
        """How many fixed grains there are."""
        return len(self.radii_m) - self.particles

    @property
    def particle_radii_m(self) -> NDArray[np.float64]:
        """Radii of the particles, in the order of their ids."""
        return self.radii_m[: self.particles]

    @property
    def particle_volumes_m3(self) -> NDArray[np.float64]:
        """Volumes of the particles, in the order of their ids."""
        volumes: NDArray[np.float64] = 4.0 / 3.0 * np.pi * self.particle_radii_m**3
        return volumes

    @property
    def particle_volume_m3(self) -> float:
        """Volume of all particles together."""
        return float(sum(sphere_volume_m3(r) for r in self.particle_radii_m.tolist()))


def populate(scene: Scene, layout: Layout) -> Population:
    """Place every sphere of a scene; the same scene and seed give the same bytes.

    Raises
    ------
    PackingError
        If they cannot be placed, with the reason.
    """
    # Two independent streams, so that more particles do not change the specimen.
    specimen_seed, suspension_seed = np.random.SeedSequence(scene.seed).spawn(2)
    grains, solid_fraction = _specimen(scene, specimen_seed)
    fixed = _single(scene, "grain")
    obstacles = _join(grains, fixed)
    movers = _single(scene, "particle")
    suspension = _suspension(scene, layout, _join(obstacles, movers), suspension_seed)
    asked = moving_count(scene, layout)
    return _assemble(scene, _join(suspension, movers), obstacles, asked, solid_fraction)


def _specimen(scene: Scene, seed: np.random.SeedSequence) -> tuple[Spheres, float]:
    specimen, grains = scene.specimen, scene.grains
    if specimen is None or grains is None or grains.radius_mean is None:
        return _nothing(), float("nan")
    size = (specimen.length, specimen.width, specimen.height or specimen.width)
    expected = expected_count(grains, specimen.solid_fraction * math.prod(size))
    require_placeable(expected, "grains", "the specimen's size or grains.radius_mean")
    wanted = {
        "solid_fraction": specimen.solid_fraction,
        "mean_m": grains.radius_mean,
        "deviation_m": grains.radius_deviation,
        "truncation": grains.radius_truncation,
    }

    def compute() -> dict[str, NDArray[np.float64]]:
        rng = np.random.default_rng(seed)
        made = cut_specimen(**wanted, size_m=size, rng=rng, cut=specimen.cut)
        return {
            "centres_m": made.spheres.centres_m,
            "radii_m": made.spheres.radii_m,
            "solid_fraction": np.array([made.solid_fraction]),
        }

    inputs: dict[str, JSON] = {
        **wanted,
        "size_m": list(size),
        "cut": specimen.cut,
        "seed": scene.seed,
    }
    stored = cached_packing("specimen", inputs, compute)
    return Spheres(stored["centres_m"], stored["radii_m"]), float(stored["solid_fraction"][0])


def _suspension(
    scene: Scene, layout: Layout, obstacles: Spheres, seed: np.random.SeedSequence
) -> Spheres:
    count = particle_count(scene, layout)
    particles = scene.particles
    if count == 0 or particles.radius_mean is None:
        return _nothing()
    mean, deviation, truncation = (
        particles.radius_mean,
        particles.radius_deviation,
        particles.radius_truncation,
    )

    def compute() -> dict[str, NDArray[np.float64]]:
        rng = np.random.default_rng(seed)
        radii = sample_radii(mean, deviation, count, rng, truncation)
        placed = place_spheres(radii, layout.fill_low, layout.fill_high, rng, obstacles=obstacles)
        return {"centres_m": placed.centres_m, "radii_m": placed.radii_m}

    inputs: dict[str, JSON] = {
        "radii": [mean, deviation, truncation, count],
        "box": [list(layout.fill_low), list(layout.fill_high)],
        "obstacles": [obstacles.centres_m.tolist(), obstacles.radii_m.tolist()],
        "seed": scene.seed,
    }
    stored = cached_packing("suspension", inputs, compute)
    return Spheres(stored["centres_m"], stored["radii_m"])


def _single(scene: Scene, kind: str) -> Spheres:
    chosen = [sphere for sphere in scene.spheres if sphere.kind == kind]
    centres = np.array([sphere.position for sphere in chosen], dtype=float).reshape(-1, 3)
    return Spheres(centres, np.array([sphere.radius for sphere in chosen], dtype=float))


def _nothing() -> Spheres:
    return Spheres(np.empty((0, 3)), np.empty(0))


def _join(a: Spheres, b: Spheres) -> Spheres:
    return Spheres(
        np.concatenate([a.centres_m, b.centres_m]), np.concatenate([a.radii_m, b.radii_m])
    )


def single_spheres(scene: Scene) -> Population:
    """The spheres that the scene places one by one, and no others."""
    movers, fixed = _single(scene, "particle"), _single(scene, "grain")
    return _assemble(scene, movers, fixed, len(movers), float("nan"))


def _assemble(
    scene: Scene, movers: Spheres, fixed: Spheres, asked: int, solid_fraction: float
) -> Population:
    everything = _join(movers, fixed)
    singles = [sphere for sphere in scene.spheres if sphere.kind == "particle"]
    velocities = np.zeros_like(everything.centres_m)
    spins = np.zeros_like(everything.centres_m)
    first = len(movers.radii_m) - len(singles)
    for row, sphere in enumerate(singles, start=first):
        velocities[row] = sphere.velocity
        spins[row] = sphere.spin
    return Population(
        centres_m=everything.centres_m,
        radii_m=everything.radii_m,
        velocities_m_s=velocities,
        spins_rad_s=spins,
        particles=len(movers.radii_m),
        asked=asked,
        solid_fraction=solid_fraction,
    )
