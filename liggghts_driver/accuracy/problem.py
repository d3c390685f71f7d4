"""Which problem a scene is, whatever it is computed with."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING

from liggghts_driver.scene.accuracy import NUMERICAL
from liggghts_driver.scene.canonical import canonical_json

if TYPE_CHECKING:
    from liggghts_driver.scene.model import Scene

#: What makes no other problem: names, what is drawn by chance, what is kept, for how long.
_BESIDE = ("title", "seed", "output", "accuracy", "time.duration", *NUMERICAL)


def problem_sha256(scene: Scene) -> str:
    """Identity of a scene's problem: the SHA-256 of all but what it is computed and kept with.

    Without drag (``drag.scheme = "none"``) a scene is another problem, not another computation.
    """
    data = scene.model_dump(mode="json", exclude_none=True)
    for name in _BESIDE:
        *tables, last = name.split(".")
        (data[tables[0]] if tables else data).pop(last, None)
    data["drags"] = scene.drag.scheme != "none"
    return hashlib.sha256(canonical_json(data).encode()).hexdigest()


def makes_a_problem(name: str) -> bool:
    """Whether scenes that differ in a dotted key are different problems."""
    return not any(name == beside or name.startswith(f"{beside}.") for beside in _BESIDE)


def is_of_another_problem(scene: Scene) -> bool:
    """Whether a scene has settings that were chosen for another problem than it is."""
    study = scene.accuracy.study if scene.accuracy else None
    return study is not None and study.problem_sha256 != problem_sha256(scene)
