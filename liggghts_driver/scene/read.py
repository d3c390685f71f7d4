"""Read a scene file, apply overrides, and refuse mistakes all at once."""

from __future__ import annotations

import difflib
import importlib
import json
import re
import shlex
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ValidationError

from liggghts_driver.errors import SceneError
from liggghts_driver.scene.checks import Mistake, scene_mistakes
from liggghts_driver.scene.model import Scene, table_class
from liggghts_driver.scene.repair import contradictions_beside

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pydantic.fields import FieldInfo
    from pydantic_core import ErrorDetails


def read_scene(path: str | Path, overrides: Sequence[str] = ()) -> Scene:
    """Read a scene from a TOML file (or from the JSON that a run directory keeps).

    Parameters
    ----------
    path
        The file.
    overrides
        ``section.key=value`` each, the value in TOML's own notation (a bare word is a text).

    Raises
    ------
    SceneError
        With every mistake of the file and the overrides in one message.
    """
    source = Path(path)
    return make_scene(_overridden(source, overrides), source.name, arguments_of(path, overrides))


def read_problem(path: str | Path, overrides: Sequence[str] = ()) -> Scene:
    """Read a scene as `read_scene` does, but for the accuracy that it asks for.

    A study that is to tell how accurate settings are cannot begin with those that it will choose.
    """
    source = Path(path)
    data = _overridden(source, overrides)
    data.pop("accuracy", None)
    return make_scene(data, source.name)


def _overridden(source: Path, overrides: Sequence[str]) -> dict[str, Any]:
    """The tables of a file with overrides applied, unchecked unless an override is no override."""
    data = load_tables(source)
    unreadable = [f"  - {fault}" for text in overrides if (fault := apply_override(data, text))]
    if not unreadable:
        return data
    messages = [f"{source.name}: overrides that cannot be understood", *unreadable]
    try:
        make_scene(data, source.name)
    except SceneError as error:
        messages.append(str(error))
    raise SceneError("\n".join(messages))


def arguments_of(path: str | Path, overrides: Sequence[str]) -> str:
    """What a command line calls the problem of a scene: its file, and overrides but of accuracy."""
    kept = [text for text in overrides if not re.match(r"\s*accuracy\b", text)]
    return shlex.join([str(path), *(word for text in kept for word in ("--set", text))])


def make_scene(data: Mapping[str, Any], source: str = "scene", arguments: str = "SCENE") -> Scene:
    """Make a scene from plain tables, as `tomllib` gives them.

    A scene that asks for an accuracy is given the settings that meet it, as if they stood in its
    tables; it keeps what it was given explicitly.

    Parameters
    ----------
    data
        The tables.
    source
        What messages call them.
    arguments
        What the command line calls the scene, for messages that tell which command to run.

    Raises
    ------
    SceneError
        Naming every mistake: key, value, bound and what to do.
    """
    scene = _checked(data, source)
    if scene.accuracy is None or scene.accuracy.is_settled:
        return scene
    # Studies come after the scene in the package, hence by name.
    accuracy = importlib.import_module("liggghts_driver.accuracy")
    settled: dict[str, Any] | Mistake = accuracy.settle(scene, arguments)
    if isinstance(settled, Mistake):
        raise SceneError(_message(source, [settled]))
    return _checked(settled, source)


def _checked(data: Mapping[str, Any], source: str) -> Scene:
    """The scene of tables as they are."""
    try:
        scene = Scene.model_validate(data)
    except ValidationError as error:
        details = error.errors()
        mistakes = [explain_detail(detail) for detail in details]
        mistakes += contradictions_beside(data, [detail["loc"] for detail in details])
        raise SceneError(_message(source, mistakes)) from None
    mistakes = scene_mistakes(scene) or _effect_mistakes(scene)
    if mistakes:
        raise SceneError(_message(source, mistakes))
    return scene


def _effect_mistakes(scene: Scene) -> list[Mistake]:
    """What the effects find wrong; they come after the scene in the package, hence by name."""
    effects = importlib.import_module("liggghts_driver.effects")
    found: list[Mistake] = effects.effect_mistakes(scene)
    return found


def _message(source: str, mistakes: Sequence[Mistake]) -> str:
    noun = "mistake" if len(mistakes) == 1 else "mistakes"
    return "\n".join([f"{source}: {len(mistakes)} {noun}", *(f"  - {m}" for m in mistakes)])


def load_tables(path: Path, what: str = "scene") -> dict[str, Any]:
    """The tables of a TOML or JSON file, unchecked; ``what`` is what messages call it.

    Raises
    ------
    SceneError
        If there is no such file, or it holds no tables.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise SceneError(f"{path}: cannot be read ({error.strerror}); check the path") from None
    except UnicodeDecodeError:
        raise SceneError(f"{path}: not a text file in UTF-8; a {what} is a TOML file") from None
    try:
        loaded = json.loads(text) if path.suffix == ".json" else tomllib.loads(text)
    except RecursionError:
        raise SceneError(f"{path}: nested too deeply to be a {what}") from None
    except ValueError as error:  # of both readers; also for numbers of thousands of digits
        raise SceneError(f"{path}: not valid {path.suffix[1:] or 'TOML'}: {error}") from None
    if not isinstance(loaded, dict):
        raise SceneError(f"{path}: a {what} is a set of tables, not a {type(loaded).__name__}")
    return loaded


def apply_override(data: dict[str, Any], text: str) -> str | None:
    """Put one ``section.key=value`` into ``data``; a sentence when it cannot be understood."""
    name, equals, value = text.partition("=")
    parts = [part.strip() for part in name.split(".")]
    if not equals or not all(parts):
        return f"--set {text!r}: must be section.key=value; e.g. --set time.duration=10"
    blocked = set_key(data, ".".join(parts), _value(value.strip()))
    if blocked is not None:
        return f"--set {text!r}: {blocked} is not a table; override a key of a table"
    return None


def set_key(data: dict[str, Any], name: str, value: Any) -> str | None:
    """Set ``section.key`` in plain tables, in place; ``spheres[0].radius`` reaches into a list.

    Returns
    -------
    str | None
        The part of the name that stands for no table, where nothing was set; None when all went
        well. Tables that are not there are made.
    """
    *tables, last = name.split(".")
    place = data
    for table in tables:
        inner = _enter(place, table)
        if inner is None:
            return table
        place = inner
    place[last] = value
    return None


def _enter(place: dict[str, Any], table: str) -> dict[str, Any] | None:
    """The table of that name, made when absent; ``spheres[0]`` is the first of a list."""
    listed = re.fullmatch(r"(\w+)\[([0-9]{1,9})\]", table)
    if listed is None and "[" in table:
        return None
    if listed is None:
        inner = place.setdefault(table, {})
    else:
        items, index = place.get(listed[1]), int(listed[2])
        inner = items[index] if isinstance(items, list) and index < len(items) else None
    return inner if isinstance(inner, dict) else None


def _value(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text  # a bare word is meant as a text


def explain_detail(detail: ErrorDetails, root: type[BaseModel] = Scene) -> Mistake:
    """What pydantic finds wrong with the tables of a class, in this package's words."""
    name = _dotted(detail["loc"]) or "scene"
    value = detail["input"]
    if detail["type"] == "extra_forbidden":
        return _unknown(detail, name, root)
    if detail["type"] == "missing":
        return Mistake(name, None, "it is needed", _fix(detail["loc"], root))
    bound = (
        detail["msg"]
        .removeprefix("Input ")
        .removeprefix("Value error, ")
        .replace("should be", "must be")
    )
    return Mistake(name, value, bound, _fix(detail["loc"], root))


def _dotted(location: tuple[int | str, ...]) -> str:
    parts = [f"[{part}]" if isinstance(part, int) else f".{part}" for part in location]
    return "".join(parts).removeprefix(".")


def _unknown(detail: ErrorDetails, name: str, root: type[BaseModel]) -> Mistake:
    table = _table(detail["loc"][:-1], root)
    valid = sorted(_keys(table))
    near = difflib.get_close_matches(str(detail["loc"][-1]), valid, n=1)
    hint = f"did you mean {near[0]}? " if near else ""
    return Mistake(
        name, _short(detail["input"]), "there is no such key", f"{hint}valid: {', '.join(valid)}"
    )


def _short(value: object) -> object:
    return "{...}" if isinstance(value, dict) else value


def _fix(location: tuple[int | str, ...], root: type[BaseModel]) -> str:
    """What to give there, from the documentation of the key."""
    names = [number for number, part in enumerate(location) if isinstance(part, str)]
    if not names:
        return "give tables and keys"
    where = location[: names[-1] + 1]  # the key; what follows is a place in its list
    field = _keys(_table(where[:-1], root)).get(str(where[-1]))
    if field is None or not field.description:
        return f"give [{_dotted(where)}]" if len(where) == 1 else "see the documentation"
    extra = field.json_schema_extra
    unit = extra.get("unit") if isinstance(extra, dict) else None
    return f"give the {field.description}" + (f" [{unit}]" if unit else "")


def _keys(table: type[BaseModel]) -> dict[str, FieldInfo]:
    """The fields of a table by the names that a file gives them."""
    return {field.alias or name: field for name, field in table.model_fields.items()}


def _table(location: tuple[int | str, ...], root: type[BaseModel]) -> type[BaseModel]:
    """The class of the table at a place in a file."""
    table = root
    for part in location:
        if isinstance(part, str) and part in table.model_fields:
            table = table_class(table.model_fields[part].annotation) or table
    return table
