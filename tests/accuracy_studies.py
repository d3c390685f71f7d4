"""Studies of accuracy as their files have them, made up, for tests that run none."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from liggghts_driver.accuracy import FINEST, problem_sha256

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from liggghts_driver.scene import Scene

QUANTITIES = ("rate_entrance", "volume_entrance_1")
COMMAND = ["/home/me/bin/liggghts-driver", "study", "accuracy", "small scene.toml"]


def row(
    knob: str,
    changes: Mapping[str, Any],
    cost: float,
    mean: float | None,
    ci95: float | None,
    overlap: float = 0.005,
    replicates: int = 8,
) -> dict[str, Any]:
    """One setting; all quantities err alike."""
    error = {"mean": mean, "ci95": ci95, "replicates": replicates}
    return {
        "knob": knob,
        "title": ", ".join(f"{name.split('.')[1]} {value}" for name, value in changes.items())
        or "reference",
        "changes": dict(changes),
        "cost_over_reference": cost,
        "errors": {name: dict(error) for name in QUANTITIES},
        "largest_overlap_over_radius": overlap,
        "below_noise": [],
    }


REFERENCE = row("reference", {}, 1.0, 0.0, 0.0)
#: Within 3.1 % with its interval.
STEP = row("step", {"time.step_fraction": 0.2}, 0.3, -0.011, 0.02)
#: Within 8 %, and so soft that contacts overlap by 4.8 % of a radius.
SOFT = row(
    "together",
    {"time.step_fraction": 0.2, "contact.stiffness_scale": 0.1},
    0.15,
    0.03,
    0.05,
    overlap=0.048,
)


def study_of(scene: Scene, *rows: dict[str, Any], **changes: Any) -> dict[str, Any]:
    """What the file of a study of a scene holds; three settings where none are given."""
    return {
        "study": "accuracy",
        "title": "A made-up study",
        "problem_sha256": problem_sha256(scene),
        "duration_s": 10.0,
        "chosen_by": list(QUANTITIES),
        "finest": dict(FINEST),
        "settings": list(rows or (REFERENCE, STEP, SOFT)),
        "provenance": {"command": COMMAND, "liggghts_driver": "0.1.0"},
        "sentences": [],
        **changes,
    }


def put(study: Mapping[str, Any], path: Path) -> Path:
    """A study in a file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(study), encoding="utf-8")
    return path
