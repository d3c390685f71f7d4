"""What a scene file may say: as a JSON schema for editors, as a page for people."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pydantic import WithJsonSchema
from pydantic_core import PydanticUndefined

from liggghts_driver.scene.model import Scene, table_class

if TYPE_CHECKING:
    from pydantic import BaseModel
    from pydantic.fields import FieldInfo


def scene_schema() -> dict[str, Any]:
    """JSON schema of a scene file; each key carries its unit and its meaning."""
    schema = Scene.model_json_schema()
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    schema["title"] = "liggghts-driver scene"
    return schema


def scene_reference() -> str:
    """Every table and key of a scene file as a page of Markdown."""
    parts = [
        "# The scene file\n",
        "TOML; SI units throughout. Keys without a default are needed.\n",
    ]
    plain = {name: field for name, field in Scene.model_fields.items() if not _table_of(field)}
    parts.append(_section("Top level", plain))
    for name, field in Scene.model_fields.items():
        table = _table_of(field)
        if table is not None:
            heading = f"[[{name}]]" if "tuple" in str(field.annotation) else f"[{name}]"
            text = " ".join((table.__doc__ or "").split())
            parts.append(_section(f"`{heading}`", table.model_fields, text))
    return "\n".join(parts)


def _table_of(field: FieldInfo) -> type[BaseModel] | None:
    """The table that a file writes for a key; none where it writes a plain value instead."""
    plain = any(isinstance(each, WithJsonSchema) for each in field.metadata)
    return None if plain else table_class(field.annotation)


def _section(heading: str, fields: dict[str, FieldInfo], text: str = "") -> str:
    lines = [f"## {heading}\n", *([f"{text}\n"] if text else [])]
    lines += ["| key | unit | default | meaning |", "|---|---|---|---|"]
    lines += [
        f"| `{name}` | {_unit(field)} | {_default(field)} | {_meaning(field)} |"
        for name, field in fields.items()
    ]
    return "\n".join(lines) + "\n"


def _unit(field: FieldInfo) -> str:
    extra = field.json_schema_extra
    return str(extra.get("unit", "")) if isinstance(extra, dict) else ""


def _default(field: FieldInfo) -> str:
    if field.default is PydanticUndefined:
        return "**needed**"
    return "" if field.default is None else f"`{field.default}`"


def _meaning(field: FieldInfo) -> str:
    return (field.description or "").replace("|", "\\|")
