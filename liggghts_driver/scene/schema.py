"""The JSON schema of a scene, for editors and for the documentation."""

from __future__ import annotations

from typing import Any

from liggghts_driver.scene.model import Scene


def scene_schema() -> dict[str, Any]:
    """JSON schema of a scene file; each key carries its unit and its meaning."""
    schema = Scene.model_json_schema()
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    schema["title"] = "liggghts-driver scene"
    return schema
