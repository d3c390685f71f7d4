"""Initial packings: the grains of a specimen and the particles of the fluid."""

from __future__ import annotations

from liggghts_driver.packing.cache import cached_packing
from liggghts_driver.packing.overlap import Spheres, meets_box, sphere_box_volume
from liggghts_driver.packing.radii import mean_sphere_volume, sample_radii
from liggghts_driver.packing.relaxation import pack_periodic, place_spheres
from liggghts_driver.packing.sequential import place_sequentially
from liggghts_driver.packing.specimen import Cut, Specimen, cut_specimen

__all__ = [
    "Cut",
    "Specimen",
    "Spheres",
    "cached_packing",
    "cut_specimen",
    "mean_sphere_volume",
    "meets_box",
    "pack_periodic",
    "place_sequentially",
    "place_spheres",
    "sample_radii",
    "sphere_box_volume",
]
