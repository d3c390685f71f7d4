"""Strict rendering: a template gets exactly what it names, and only plain numbers and texts."""

from __future__ import annotations

import math
from functools import cache
from typing import TYPE_CHECKING

import jinja2

from liggghts_driver.errors import DeckError
from liggghts_driver.resources import templates_dir

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path


def environment() -> jinja2.Environment:
    """A Jinja environment that refuses undefined names and values that are no plain text."""
    return _environment(templates_dir())


@cache
def _environment(folder: Path) -> jinja2.Environment:
    # Kept: compiling the templates takes longer than writing a deck.
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(folder),
        undefined=jinja2.StrictUndefined,
        finalize=_plain,
        autoescape=False,  # noqa: S701 - decks are not HTML
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )


def render(template: str, values: Mapping[str, object]) -> str:
    """Render a template of the deck.

    Raises
    ------
    DeckError
        If the template names something unknown, or a value would print as None, NaN or a list.
    """
    try:
        return environment().get_template(template).render(values)
    except jinja2.TemplateError as error:
        line = getattr(error, "lineno", None)
        where = f"{template}, line {line}" if line else template
        raise DeckError(f"{where}: {type(error).__name__}: {error}") from error


def _plain(value: object) -> object:
    """What ``{{ value }}`` prints: texts and finite numbers only, numbers to full precision."""
    if isinstance(value, jinja2.Undefined):
        return value  # StrictUndefined complains by itself when printed
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise DeckError(f"a {type(value).__name__} ({value!r}) cannot stand in a deck")
    if isinstance(value, float):
        if not math.isfinite(value):
            raise DeckError(f"{value!r} cannot stand in a deck")
        return repr(float(value))
    return value
