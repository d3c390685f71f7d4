"""The sweep file: what a user says about many runs of one scene, checked and frozen.

Every table of the TOML file is one class here, every key one field, as in a scene file.
"""

from __future__ import annotations

import re
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, ValidationError

from liggghts_driver.errors import SceneError, SweepError
from liggghts_driver.scene.fields import FrozenDict, Line, Number, Table, Whole, key
from liggghts_driver.scene.read import explain_detail, load_tables

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

#: The name in a table of scales that stands for every key without one of its own.
EVERY_KEY = "all"
_NUMBER = re.compile(r"-?\b(\d+(\.\d+)?(e[+-]?\d+)?|inf|nan)\b")


def _flat(value: Any) -> Any:
    """Nested tables as dotted keys: TOML makes tables of ``pressure.gradient = 1``."""
    return dict(_leaves("", value)) if isinstance(value, dict) else value


def _leaves(prefix: str, table: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    for name, value in table.items():
        if isinstance(value, dict):
            yield from _leaves(f"{prefix}{name}.", value)
        else:
            yield f"{prefix}{name}", value


def _dotted(name: str) -> str:
    parts = name.split(".")
    if not all(part and part == part.strip() and "=" not in part for part in parts):
        raise ValueError("must be a key of the scene, e.g. pressure.gradient")
    return name


def _scales(value: Any) -> Any:
    return {EVERY_KEY: value} if isinstance(value, str) else _flat(value)


def _one_word(text: str) -> str:
    if len(text.split()) != 1 or text != text.strip():
        raise ValueError("must be one word")
    return text


def _option(text: str) -> str:
    if not text.startswith("-"):
        raise ValueError("must begin with -")
    return text


#: A key of a scene with its tables: ``pressure.gradient``, ``spheres[0].radius``.
Key = Annotated[Line, AfterValidator(_dotted)]
#: A name without blanks: it stands in a line of a job script.
Word = Annotated[Line, AfterValidator(_one_word)]
Option = Annotated[Line, AfterValidator(_option)]
Settings = Annotated[dict[Key, Any], BeforeValidator(_flat), AfterValidator(FrozenDict)]
Ranges = Annotated[
    dict[Key, tuple[Number, Number]], BeforeValidator(_flat), AfterValidator(FrozenDict)
]
Scale = Literal["linear", "log"]
Scales = Annotated[dict[Key, Scale], BeforeValidator(_scales), AfterValidator(FrozenDict)]


class Resources(Table):
    """What every point is given; an axis may vary ranks, nodes and walltime_s."""

    ranks: Whole = key("", "MPI ranks of one run", 1, ge=1)
    nodes: Whole = key("", "machines over which the ranks of one run are spread", 1, ge=1)
    walltime_s: Number | None = key(
        "s", "time limit of a job; default: the one of the cluster", None, gt=0
    )
    pack: Whole = key("", "points in one job, run one after another", 1, ge=1)
    retries: Whole = key("", "number of times that a failed point is tried again", 1, ge=0)


class SlurmSettings(Table):
    """What the jobs of a cluster need beyond their resources."""

    partition: Word | None = key("", "partition; default: the one of the cluster", None)
    account: Word | None = key("", "account that is charged; default: the user's own", None)
    qos: Word | None = key("", "quality of service; default: the one of the account", None)
    options: tuple[Option, ...] = key(
        "", 'options of sbatch beyond those of the resources, e.g. "--exclusive"', ()
    )
    template: Line | None = key(
        "", "Jinja template of the job script, instead of the shipped one", None
    )


class Axis(Table):
    """One axis: a list of values, a range, combinations of several keys, or a sample.

    A list has ``key`` and ``values``; a range ``key``, ``from``, ``to``, ``count`` and maybe
    ``scale``; combinations have ``keys`` and one row of ``values`` each; a sample has ``sample``,
    ``count``, ``ranges`` and maybe ``scale``.
    """

    name: Key | None = key("", "key of the scene that varies", None, alias="key")
    keys: tuple[Key, ...] = key("", "keys of the scene that vary together", ())
    values: tuple[Any, ...] = key("", "values of the key, or a row of values for the keys", ())
    first: Number | None = key("as the key", "first value of a range", None, alias="from")
    last: Number | None = key("as the key", "last value of a range", None, alias="to")
    count: Whole | None = key("", "number of values", None, ge=1)
    scale: Scales = key("", "scale, linear or log; of a sample also for each key of its own", {})
    sample: Literal["latin-hypercube", "sobol"] | None = key(
        "", "way to spread points over the ranges: latin-hypercube or sobol", None
    )
    ranges: Ranges = key("as each key", "lowest and highest value of each key, [low, high]", {})

    def scale_of(self, name: str) -> Scale:
        """The scale on which a key is spread."""
        scale: Scale = self.scale.get(name, self.scale.get(EVERY_KEY, "linear"))
        return scale


class Sweep(Table):
    """One sweep, complete."""

    title: Line = key("", "one line for the reports", "")
    scene: Line = key("", "scene file, seen from the sweep file; or the name of a shipped case")
    root_seed: Whole | None = key(
        "",
        "root of the seeds of replicates and samples; default: the scene's seed, which is then "
        "that of replicate 0",
        None,
        ge=0,
    )
    replicates: Whole = key(
        "", "number of runs of each combination, all combinations with the same seeds", 1, ge=1
    )
    settings: Settings = key("", "keys of the scene with other values", {}, alias="set")
    resources: Resources = Resources()
    axes: tuple[Axis, ...] = key("", "axes along which the scene varies; they multiply", ())
    slurm: SlurmSettings = SlurmSettings()


@dataclass(frozen=True)
class SweepFile:
    """A sweep file as read: what is good of it, and what is not.

    Attributes
    ----------
    name
        Of the file.
    sweep
        The sweep without its mistaken parts.
    axes
        Its axes by their number in the file.
    mistakes
        Of single keys; a sentence each.
    """

    name: str
    sweep: Sweep
    axes: dict[int, Axis]
    mistakes: list[str]


def read_sweep(path: Path) -> SweepFile:
    """Read a sweep file; what is wrong with single keys is told, and left out.

    Raises
    ------
    SweepError
        If the file cannot be read, or is no sweep without what is wrong with it.
    """
    try:
        data = load_tables(path, "sweep")
    except SceneError as error:
        raise SweepError(str(error)) from None
    try:
        sweep = Sweep.model_validate(data)
        return SweepFile(path.name, sweep, dict(enumerate(sweep.axes)), [])
    except ValidationError as error:
        details = error.errors()
    mistakes = [str(explain_detail(detail, Sweep)) for detail in details]
    bad = [detail["loc"] for detail in details]
    wrong = {location[1] for location in bad if location[0] == "axes" and len(location) > 1}
    gone = {location[0] for location in bad if location[0] != "axes" or len(location) == 1}
    mended = {name: value for name, value in data.items() if name not in gone}
    axes = {n: axis for n, axis in enumerate(mended.get("axes", ())) if n not in wrong}
    try:
        sweep = Sweep.model_validate(mended | {"axes": list(axes.values())})
    except ValidationError:
        raise mistaken(path.name, mistakes) from None
    return SweepFile(path.name, sweep, dict(zip(axes, sweep.axes, strict=True)), mistakes)


def mistaken(source: str, mistakes: Sequence[str]) -> SweepError:
    """One message of all mistakes."""
    noun = "mistake" if len(mistakes) == 1 else "mistakes"
    lines = [f"{source}: {len(mistakes)} {noun}", *(f"  - {line}" for line in mistakes)]
    return SweepError("\n".join(lines))


class Gathered:
    """Mistakes of many points: the same of several is one, and numbers make no difference."""

    def __init__(self) -> None:
        self._found: dict[tuple[str, str], list[str]] = {}

    @contextmanager
    def at(self, values: Mapping[str, Any]) -> Iterator[None]:
        """Take in every mistake that is told of the points with these values, and go on."""
        try:
            yield
        except SceneError as error:
            self._add(str(error).splitlines(), values)

    def _add(self, message: Sequence[str], values: Mapping[str, Any]) -> None:
        place = ", ".join(f"{name} = {value!r}" for name, value in values.items())
        # One mistake may stand alone; several follow a line that counts them.
        for line in message[1:] or message:
            text = line.removeprefix("  - ")
            name, _, rest = text.partition(" ")
            self._found.setdefault((name, _NUMBER.sub("#", rest)), [text]).append(place)

    def lines(self, points: int, runs_each: int) -> list[str]:
        """One line for each mistake, with the number of points of so many that have it."""
        found = []
        for text, *places in self._found.values():
            some = f"{len(places) * runs_each} of {points * runs_each} points"
            everywhere = len(places) == points
            found.append(text if everywhere else f"{some}, the first with {places[0]}: {text}")
        return found
