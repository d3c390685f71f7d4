"""Where the commands print for people."""

from __future__ import annotations

from typing import Any

from rich.console import Console


def new_console(**options: Any) -> Console:
    """A console that leaves names as they are: what looks like an emoji in a path is none."""
    return Console(emoji=False, **options)
