"""Pressure gradients as written on the command line."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.errors import SceneError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

#: A table of more rows is no table.
_MOST = 10_000


def parse_gradients(texts: Sequence[str]) -> float | NDArray[np.float64]:
    """One gradient, or several: ``10``, ``1 2 5``, ``1,2,5`` or ``start:stop:count`` [Pa/m].

    Raises
    ------
    SceneError
        Naming everything that is neither.
    """
    words = [word for text in texts for word in text.replace(",", " ").split()]
    values: list[float] = []
    faults = []
    for word in words:
        try:
            values += _range(word) if ":" in word else [_number(word)]
        except ValueError as error:
            faults.append(f"  - --gradient {word!r}: {error}")
    if faults or not values:
        hint = "give numbers in Pa/m, or start:stop:count"
        raise SceneError("\n".join([f"gradients that cannot be understood; {hint}", *faults]))
    return values[0] if len(values) == 1 else np.array(values)


def _range(word: str) -> list[float]:
    parts = word.split(":")
    count = int(parts[2]) if len(parts) == 3 and re.fullmatch("[0-9]{1,6}", parts[2]) else 0
    if not 2 <= count <= _MOST:
        raise ValueError(f"a range is start:stop:count with a count of at least 2, at most {_MOST}")
    with np.errstate(over="ignore", invalid="ignore"):
        values = np.linspace(_number(parts[0]), _number(parts[1]), count)
    if not np.all(np.isfinite(values)):
        raise ValueError("its steps are larger than any number")
    return [float(value) for value in values]


def _number(word: str) -> float:
    value = float(word)
    if not math.isfinite(value):
        raise ValueError("must be a finite number")
    return value
