"""Numbers as people read them: few digits, SI prefixes, an error beside each measured value."""

from __future__ import annotations

import math
from dataclasses import dataclass

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
#: What stands where there is no number.
NONE = "–"

#: For each dimension, named by its SI unit, units and their sizes in SI, the largest first.
_UNITS = {
    "s": (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6), ("ns", 1e-9)),
    "m": (("m", 1.0), ("mm", 1e-3), ("µm", 1e-6), ("nm", 1e-9)),
    "m/s": (("m/s", 1.0), ("mm/s", 1e-3), ("µm/s", 1e-6), ("nm/s", 1e-9)),
    "m³": (("m³", 1.0), ("cm³", 1e-6), ("mm³", 1e-9), ("µm³", 1e-18)),
    "m³/s": (("m³/s", 1.0), ("cm³/s", 1e-6), ("mm³/s", 1e-9), ("µm³/s", 1e-18)),
    "N": (("N", 1.0), ("mN", 1e-3), ("µN", 1e-6), ("nN", 1e-9)),
    "J": (("J", 1.0), ("mJ", 1e-3), ("µJ", 1e-6), ("nJ", 1e-9), ("pJ", 1e-12)),
}


@dataclass(frozen=True)
class Unit:
    """A unit to show values in: its name, and its size in SI."""

    name: str
    size: float

    def of(self, value: float) -> float:
        """A value given in SI, in this unit."""
        return value / self.size


def unit_for(dimension: str, largest: float) -> Unit:
    """The largest unit in which a value is at least 0.1; the smallest if it is less in all.

    Parameters
    ----------
    dimension
        Its SI unit: ``s``, ``m``, ``m/s``, ``m³``, ``m³/s``, ``N`` or ``J``.
    largest
        Largest absolute value to show, in SI; SI itself is for zero.
    """
    units = [Unit(*unit) for unit in _UNITS[dimension]]
    if largest == 0.0:
        return units[0]
    return next((unit for unit in units if unit.of(largest) >= 0.1), units[-1])


def number(value: float | None, digits: int = 3) -> str:
    """A number to so many significant digits; a power of ten only where zeros would abound."""
    if value is None:
        return NONE
    if isinstance(value, int):
        return _typeset(f"{value:,}")
    if value == 0.0 or 1e-3 <= abs(value) < 1e5:
        decimals = 0 if value == 0.0 else max(0, digits - 1 - math.floor(math.log10(abs(value))))
        return _typeset(f"{value:,.{decimals}f}")
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    return f"{_typeset(mantissa)} × 10{str(int(exponent)).translate(_SUPERSCRIPTS)}"


def decimals_for(error: float | None) -> int | None:
    """Decimals that show an error to two digits; None when it is unknown or zero."""
    if error is None or error <= 0.0:
        return None
    return max(0, 1 - math.floor(math.log10(error)))


def fixed(value: float | None, decimals: int | None) -> str:
    """A number to so many decimals; to three significant digits where these are unknown."""
    if value is None or decimals is None:
        return number(value)
    return _typeset(f"{value:,.{decimals}f}")


def with_error(value: float, error: float | None) -> str:
    """``value ± error``, both to the digits that the error leaves; the value alone without one."""
    decimals = decimals_for(error)
    return fixed(value, decimals) + (f" ± {fixed(error, decimals)}" if decimals is not None else "")


def quantity(value: float | None, dimension: str, digits: int = 3) -> str:
    """A value given in SI with a unit that fits it."""
    if value is None:
        return NONE
    unit = unit_for(dimension, abs(value))
    return f"{number(unit.of(value), digits)} {unit.name}"


def _typeset(text: str) -> str:
    """A true minus sign; narrow spaces between thousands from 10 000 on."""
    whole, dot, rest = text.partition(".")
    separator = "" if len(whole.lstrip("-")) < len("10,000") else "\u202f"
    return (whole.replace(",", separator) + dot + rest).replace("-", "\u2212")
