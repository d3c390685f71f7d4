"""Scenes as plain tables for tests without an engine: small, quick to place, easy to change."""

from __future__ import annotations

import copy
import enum
import tomllib
from typing import TYPE_CHECKING, Any

from liggghts_driver.case import Case, make_case
from liggghts_driver.resources import cases_dir
from liggghts_driver.scene import Scene, make_scene

if TYPE_CHECKING:
    from collections.abc import Mapping

Tables = dict[str, Any]


class Gone(enum.Enum):
    """What a key is changed to when it is taken out; an enum, so that it has one name."""

    GONE = "gone"

    def __repr__(self) -> str:
        return self.value


GONE = Gone.GONE

MATERIAL = {"density": 7000.0, "youngs_modulus": 1.0e7, "poissons_ratio": 0.25}
FLUID = {"density": 2000.0, "viscosity": 0.001}
GRAIN = {"kind": "grain", "radius": 0.002, "position": [0.01, 0.0, 0.0]}

#: Two spheres on their way to a head-on collision in a box: the least that a scene can be.
COLLISION: Tables = {
    "particles": MATERIAL,
    "spheres": [
        {"radius": 0.0015, "position": [-0.0016, 0.0, 0.0], "velocity": [0.005, 0.0, 0.0]},
        {"radius": 0.0015, "position": [0.0016, 0.0, 0.0], "velocity": [-0.005, 0.0, 0.0]},
    ],
    "contact": {"damping_ratio": 0.1},
    "box": {"low": [-0.02, -0.005, -0.005], "high": [0.02, 0.005, 0.005]},
    "time": {"duration": 0.1},
    "output": {"samples": 20, "frames": 5, "images": 0},
}

#: The paper's problem with forty particles and a handful of grains: placed in a few milliseconds.
INFILTRATION: Tables = {
    "fluid": {**FLUID, "velocity_outside": "piston"},
    "particles": {**MATERIAL, "radius_mean": 0.0015, "radius_deviation": 0.0001, "count": 40},
    "grains": {"youngs_modulus": 1.0e6, "poissons_ratio": 0.25, "radius_mean": 0.004},
    "reservoir": {"length": 0.03},
    "specimen": {
        "length": 0.02,
        "width": 0.02,
        "solid_fraction": 0.3,
        "permeability_grains": 1.0e-9,
        "permeability_matrix": 1.0e-6,
    },
    "piston": {"acceleration": 2.143e-3},
    "pressure": {"gradient": 10.0},
    "contact": {"damping_ratio": 0.1},
    "time": {"duration": 1.0},
    "output": {"samples": 20, "frames": 5, "images": 0},
}


def changed(tables: Mapping[str, Any], changes: Mapping[str, Any]) -> Tables:
    """A deep copy with keys set by dotted names, ``{"time.step": 1e-4, "box": GONE}``."""
    result = copy.deepcopy(dict(tables))
    for name, value in changes.items():
        *parents, last = name.split(".")
        place = result
        for parent in parents:
            place = place.setdefault(parent, {})
        if value is GONE:
            del place[last]
        else:
            place[last] = copy.deepcopy(value)
    return result


def shipped(name: str) -> Tables:
    """The tables of a shipped case."""
    return tomllib.loads((cases_dir() / f"{name}.toml").read_text(encoding="utf-8"))


def scene_of(tables: Mapping[str, Any], changes: Mapping[str, Any] | None = None) -> Scene:
    """The scene of some tables, changed."""
    return make_scene(changed(tables, changes or {}))


def case_of(tables: Mapping[str, Any], changes: Mapping[str, Any] | None = None) -> Case:
    """The case of some tables, changed."""
    return make_case(scene_of(tables, changes))
