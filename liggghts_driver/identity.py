"""What a run is known by: the hash of its scene, and of the templates that its deck came from."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING

from liggghts_driver.resources import templates_dir
from liggghts_driver.scene.canonical import canonical_json

if TYPE_CHECKING:
    from liggghts_driver.scene.model import Scene

#: Keys that came when there were runs already; without them a scene is what it was before.
_LATER_KEYS = (("pressure", "period"),)


def scene_hash(scene: Scene) -> str:
    """Identity of a scene: the SHA-256 of its canonical form, title left out."""
    # A name changes no result, nor does the wish by which the settings in the tables were chosen.
    data = scene.model_dump(mode="json", exclude={"title", "accuracy"})
    for table, key in _LATER_KEYS:
        if data[table] is not None and data[table][key] is None:
            del data[table][key]
    return hashlib.sha256(canonical_json(data).encode()).hexdigest()


def templates_hash() -> str:
    """Identity of the deck's templates: the SHA-256 of their names and texts."""
    digest = hashlib.sha256()
    root = templates_dir()
    for path in (*sorted(root.glob("*.in.j2")), *sorted((root / "effects").glob("*.j2"))):
        digest.update(f"{path.relative_to(root)}\0".encode() + path.read_bytes())
    return digest.hexdigest()
