"""Which sweeps make the page, and which of their points are readings of the paper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from liggghts_driver.resources import cases_dir

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

#: The sweeps in the order in which they are run: what the page needs most comes first.
SWEEPS = (
    "gradient",
    "outside_fluid",
    "exit",
    "piston_mass",
    "grains",
    "friction",
    "reservoir",
    "more_gradients",
    "piston_follows",
    "viscous",
    "settings",
)
GRADIENT, FRACTION = "pressure.gradient", "particles.volume_fraction"
STIFFNESS = "contact.stiffness_scale"


def sweep_file(name: str) -> Path:
    """The shipped file of a sweep."""
    return cases_dir() / "paper" / f"{name}.toml"


@dataclass(frozen=True)
class Series:
    """A reading of the paper at many gradients.

    Attributes
    ----------
    name
        For legends and heads of tables.
    title
        In full.
    parts
        Sweeps that have its points, each with the gradients that count [Pa/m]; empty: all of them.
    """

    name: str
    title: str
    parts: Mapping[str, tuple[float, ...]]


#: The reading that the others vary: the outside fluid goes with the piston.
MAIN = Series("with the piston", "the outside fluid goes with the piston", {"gradient": ()})
PRINTED = Series(
    "v_f = a t", "the outside fluid as printed, v_f = a t for ever", {"outside_fluid": ()}
)
#: At 10 Pa/m the piston that follows is the paper's.
FOLLOWS = Series(
    "piston follows",
    "a piston whose acceleration goes with the gradient",
    {"gradient": (10.0,), "piston_follows": ()},
)
VISCOUS = Series(
    "viscous", "that piston, and a fluid ten times as viscous, below Re = 1", {"viscous": ()}
)
#: The readings of Table 1.
TABLE_READINGS = (MAIN, PRINTED)
#: The main reading with the gradients that the paper does not have.
ALL_GRADIENTS = Series(MAIN.name, MAIN.title, {"gradient": (), "more_gradients": ()})


@dataclass(frozen=True)
class Reading:
    """A reading at the paper's main gradient: where its points are, and what it is called.

    ``beside`` is what it differs from in one thing alone; None for the first of the readings. A
    ``control`` is none of what the paper may mean: something else is held against it.
    """

    title: str
    sweep: str
    values: Mapping[str, Any]
    beside: Reading | None = None
    control: bool = False


FIRST = Reading(MAIN.name, "gradient", {GRADIENT: 10.0})
AS_PRINTED = Reading(PRINTED.name, "outside_fluid", {GRADIENT: 10.0}, FIRST)
#: What whole grains are held against: cut ones at the fraction at which whole ones fit.
CUT_AT_HALF = Reading("cut grains (0.50)", "grains", {"specimen.cut": "bulk"}, FIRST, control=True)
#: What the cheaper settings of all others are held against.
SETTINGS = Reading("paper's step and stiffness", "settings", {STIFFNESS: 1.0}, FIRST, control=True)
READINGS = (
    FIRST,
    AS_PRINTED,
    Reading("exit open", "exit", {"specimen.exit": "open"}, FIRST),
    Reading("piston of 2.15 kg", "piston_mass", {"piston.mass": 2.15}, FIRST),
    Reading("piston of 0.215 kg", "piston_mass", {"piston.mass": 0.215}, FIRST),
    Reading("whole grains inside (0.50)", "grains", {"specimen.cut": "inside"}, CUT_AT_HALF),
    CUT_AT_HALF,
    Reading("reservoir of 0.31 m (v_p = 0.10)", "reservoir", {FRACTION: 0.10}, FIRST),
    Reading("reservoir of 0.12 m (v_p = 0.25)", "reservoir", {FRACTION: 0.25}, FIRST),
    SETTINGS,
)
#: Friction is no reading of Table 1, which has none: Fig. 6.
FRICTIONS = tuple(
    Reading(f"friction {value:g}", "friction", {"contact.friction": value}, FIRST)
    for value in (0.1, 0.2, 0.5)
)
