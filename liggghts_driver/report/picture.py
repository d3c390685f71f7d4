"""A picture of the report."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Picture:
    """A PNG with what it shows: ``name`` is its file's stem, ``alt`` describes it in words."""

    name: str
    png: bytes
    alt: str
    caption: str
