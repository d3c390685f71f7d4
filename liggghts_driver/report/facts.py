"""A run in numbers: lists of labelled facts."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from liggghts_driver.report.numbers import number, quantity

if TYPE_CHECKING:
    from collections.abc import Mapping

_PARTS = {
    "place_spheres_s": "Placing the spheres",
    "engine_pair_s": "Engine: contact forces",
    "engine_neigh_s": "Engine: neighbour lists",
    "engine_comm_s": "Engine: communication",
    "engine_outpt_s": "Engine: output",
    "engine_modfy_s": "Engine: walls, fluid and motion",
    "engine_other_s": "Engine: everything else",
    "analyse_s": "Analysis",
}
_PROVENANCE = {
    "scene_sha256": "Scene (SHA-256)",
    "templates_sha256": "Templates (SHA-256)",
    "liggghts_driver": "liggghts-driver",
    "numpy": "NumPy",
}


@dataclass(frozen=True)
class Facts:
    """A titled list of labels and texts."""

    title: str
    items: list[tuple[str, str]]


def overview(results: Mapping[str, Any]) -> list[Facts]:
    """Spheres, time, limits and cost of a run."""
    return [
        Facts("Spheres", _spheres(results)),
        Facts("Time", _time(results)),
        Facts("Limits", _limits(results)),
        Facts("Cost", _cost(results["cost"])),
    ]


def _spheres(results: Mapping[str, Any]) -> list[tuple[str, str]]:
    counts, specimen = results["counts"], results["specimen"]
    items = [
        ("Particles asked for", number(counts["asked"])),
        ("Particles placed", number(counts["placed"])),
        ("Particles at the end", number(counts["at_end"])),
    ]
    if counts["grains"]:
        items.append(("Grains", number(counts["grains"])))
    if specimen:
        items.append(("Solid fraction asked for", number(specimen["solid_fraction_asked"])))
        items.append(("Solid fraction measured", number(specimen["solid_fraction"])))
    return items


def _time(results: Mapping[str, Any]) -> list[tuple[str, str]]:
    bound = results["time_step_bounds"][0]
    step = results["time_step_s"]
    return [
        ("Simulated time", quantity(step * results["cost"]["steps"], "s")),
        ("Steps", number(results["cost"]["steps"])),
        ("Time step", quantity(step, "s")),
        ("Largest step allowed", f"{quantity(bound['step_s'], 's')}: {bound['reason']}"),
    ]


def _limits(results: Mapping[str, Any]) -> list[tuple[str, str]]:
    overlap = results["max_overlap_over_radius"]
    percent = number(None if overlap is None else 100.0 * overlap, 2)
    return [
        ("Largest overlap", f"{percent} % of the smaller radius"),
        ("Largest speed", quantity(results["largest_speed_m_s"], "m/s")),
    ]


def _cost(cost: Mapping[str, Any]) -> list[tuple[str, str]]:
    ranks = "1 process" if cost["ranks"] == 1 else f"{number(cost['ranks'])} processes"
    return [
        ("Wall time of the engine", f"{quantity(cost['wall_s'], 's')} on {ranks}"),
        *((("Processor time of it", quantity(cost["cpu_s"], "s")),) if cost["cpu_s"] else ()),
        ("Particle steps per second", number(cost["particle_steps_per_s"])),
        *(
            (_PARTS.get(part, part), quantity(seconds, "s"))
            for part, seconds in cost["parts"].items()
            if part != "engine_s"  # the wall time, said already
        ),
    ]


def provenance(results: Mapping[str, Any]) -> Facts:
    """What made the result: hashes, versions, the command."""
    items = []
    for name, value in results["provenance"].items():
        label = _PROVENANCE.get(name, name.capitalize())
        items.append((label, shlex.join(value) if isinstance(value, list) else str(value)))
    return Facts("Provenance", items)
