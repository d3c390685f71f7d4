"""What the tables of a scene are made of: numbers, texts, keys with their units, frozen tables."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, Strict

#: Sizes of numbers that mean something in SI units; beyond, arithmetic itself would fail.
_SMALLEST, _LARGEST = 1e-30, 1e30


def _within_reason(value: float) -> float:
    if value != 0.0 and not _SMALLEST <= abs(value) <= _LARGEST:
        raise ValueError(f"must be 0, or of a size from {_SMALLEST:g} to {_LARGEST:g}")
    return value


Number = Annotated[float, Strict(), Field(allow_inf_nan=False), AfterValidator(_within_reason)]
Whole = Annotated[int, Strict()]
Switch = Annotated[bool, Strict()]
Vector = tuple[Number, Number, Number]
#: A text without control characters: it stands in a comment of the deck.
Line = Annotated[str, Strict(), Field(pattern=r"^[^\x00-\x08\x0a-\x1f\x7f\x85\u2028\u2029]*$")]
Face = Literal["x-", "x+", "y-", "y+", "z-", "z+"]


class FrozenDict(dict[str, Any]):
    """A dictionary that never changes after reading, as everything in a scene."""

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(tuple(sorted(self.items())))

    def _refuse(self, *_: Any, **__: Any) -> Any:
        raise TypeError("a scene is frozen")

    __setitem__ = __delitem__ = update = setdefault = pop = popitem = clear = __ior__ = _refuse


Numbers = Annotated[dict[str, Number], AfterValidator(FrozenDict)]


def key(unit: str, meaning: str, default: Any = ..., **bounds: Any) -> Any:
    """A documented key: its unit (``""`` for a pure number), its meaning, its bounds."""
    return Field(default, description=meaning, json_schema_extra={"unit": unit}, **bounds)


class Table(BaseModel):
    """A TOML table: unknown keys are refused, values never change after reading."""

    model_config = ConfigDict(extra="forbid", frozen=True, validate_default=True)
