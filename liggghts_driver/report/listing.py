"""A scene as its file would say it, every default filled in, every unit beside its value."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel

if TYPE_CHECKING:
    from collections.abc import Iterator

    from liggghts_driver.scene.model import Scene


def scene_listing(scene: Scene) -> str:
    """A scene as TOML; what it leaves out is left out here.

    So is the accuracy that it asked for: the settings that it came to are listed.
    """
    written_out = scene.model_copy(update={"accuracy": None})
    return "\n".join(_table(written_out, "")).strip() + "\n"


def _table(table: BaseModel, name: str) -> Iterator[str]:
    """The keys of a table, then the tables in it."""
    inner: list[str] = []
    for key, field in type(table).model_fields.items():
        value = getattr(table, key)
        path = f"{name}.{key}" if name else key
        if isinstance(value, BaseModel):
            inner += ["", f"[{path}]", *_table(value, path)] if _says_anything(value) else []
        elif isinstance(value, tuple) and value and isinstance(value[0], BaseModel):
            for item in value:
                inner += ["", f"[[{path}]]", *_table(item, path)]
        elif value is not None and value != ():
            extra = field.json_schema_extra
            unit = extra.get("unit") if isinstance(extra, dict) else None
            yield f"{key} = {_value(value)}" + (f"  # {unit}" if unit else "")
    yield from inner


def _says_anything(table: BaseModel) -> bool:
    return any(value is not None for _, value in table)


def _value(value: Any) -> str:
    """A value in TOML's notation, which is JSON's for all that a scene holds."""
    return json.dumps(value, ensure_ascii=False)
