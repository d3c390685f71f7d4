"""The hard cases: scenes in which a simulation is likely to break, and what is expected of each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from liggghts_driver.resources import cases_dir

if TYPE_CHECKING:
    from pathlib import Path

#: What the first line of a scene file begins with.
_HARD = "# Hard: "

Expected = Literal["holds", "refused", "invalid"]


@dataclass(frozen=True)
class HardCase:
    """One scene file of ``cases/hard``.

    Attributes
    ----------
    expected
        Whether every invariant holds, the scene is refused before anything is run, or it must end
        without an answer that is called valid.
    quick
        Whether it takes seconds.
    restarts
        Whether it is also run in parts, from checkpoints.
    """

    name: str
    expected: Expected = "holds"
    quick: bool = True
    restarts: bool = False

    @property
    def path(self) -> Path:
        """The scene file."""
        return cases_dir() / "hard" / f"{self.name}.toml"

    @property
    def hard(self) -> str:
        """What is hard about it, in a sentence: the first line of the file."""
        with self.path.open(encoding="utf-8") as file:
            return file.readline().strip().removeprefix(_HARD)


CASES = (
    HardCase("micrometre_viscous", quick=False),
    HardCase("stiff_contacts", quick=False),
    HardCase("soft_contacts"),
    HardCase("size_ratio_10"),
    HardCase("size_ratio_30"),
    HardCase("size_ratio_50", quick=False),
    HardCase("piston_at_speed", quick=False),
    HardCase("jammed_bed", quick=False),
    HardCase("blocked_inlet"),
    HardCase("restitution_lowest"),
    HardCase("restitution_half"),
    HardCase("restitution_one"),
    HardCase("reynolds_all"),
    HardCase("overlapping_start"),
    HardCase("on_wall_and_edge"),
    HardCase("on_section"),
    HardCase("centre_on_wall", "invalid"),
    HardCase("same_place", "refused"),
    HardCase("one_particle"),
    HardCase("no_particle"),
    HardCase("gradient_thousandfold", quick=False),
    HardCase("gradient_negative", quick=False),
    HardCase("gradient_changes_sign"),
    HardCase("friction_ten"),
    HardCase("friction_elastic", "invalid"),
    HardCase("fluid_reverses"),
    HardCase("no_wide_pores", quick=False),
    HardCase("restart_in_contact", quick=False, restarts=True),
    HardCase("ten_million_steps", quick=False),
)


def hard_cases(names: list[str] | None = None, *, quick: bool = False) -> list[HardCase]:
    """The cases of these names, or all; with ``quick`` those of them that take seconds.

    Raises
    ------
    KeyError
        With the names that are none.
    """
    known = {case.name: case for case in CASES}
    unknown = [name for name in names or () if name not in known]
    if unknown:
        raise KeyError(*unknown)
    wanted = [known[name] for name in names] if names else list(CASES)
    return [case for case in wanted if case.quick or not quick]
