"""How pages are rendered: every text escaped, every unknown name an error."""

from __future__ import annotations

import base64
from typing import TYPE_CHECKING

import jinja2

from liggghts_driver.report.numbers import number
from liggghts_driver.resources import templates_dir

if TYPE_CHECKING:
    from liggghts_driver.report.picture import Picture


def page_environment() -> jinja2.Environment:
    """Every text is escaped, every unknown name is an error."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(templates_dir()),
        undefined=jinja2.StrictUndefined,
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"data_uri": _data_uri, "number": number}
    return environment


def _data_uri(picture: Picture) -> str:
    return "data:image/png;base64," + base64.b64encode(picture.png).decode("ascii")
