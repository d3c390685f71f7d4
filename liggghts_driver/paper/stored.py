"""The stored results: one small file with all that the page and its figures are made of."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

from liggghts_driver.errors import ParseError
from liggghts_driver.outputs import write_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

#: What is said of a point without a run.
NOT_RUN = "not run yet"
#: Raised with every change of the file's form.
FORM = 1


@dataclass(frozen=True)
class Measured:
    """A mean of one run with its 95 % interval in time, and on what it rests; all in SI."""

    mean: float | None
    ci95: float | None
    steady: bool
    from_s: float
    reason: str


@dataclass(frozen=True)
class Curves:
    """What a run did in time, thinned: samples at 0, ``interval_s``, twice that, and so on.

    Volumes in mm3 and places in micrometres, as whole numbers: a particle has 14 mm3.
    """

    interval_s: float
    volume_mm3: Mapping[str, list[int]]
    piston_x_um: list[int]

    @property
    def end_s(self) -> float:
        """The instant of the last sample."""
        return (len(self.piston_x_um) - 1) * self.interval_s

    def sample_at(self, time_s: float) -> int:
        """The number of the first sample that is not before an instant."""
        return math.ceil(time_s / self.interval_s - 1e-9)

    def rate_m3_s(self, section: str, first: int, last: int = -1) -> float:
        """The mean flow rate past a section from one sample to another."""
        steps = range(len(self.volume_mm3[section]))
        passed_m3 = self.passed_m3(section, first, last)
        return passed_m3 / ((steps[last] - steps[first]) * self.interval_s)

    def passed_m3(self, section: str, first: int, last: int = -1) -> float:
        """The volume that passes a section from one sample to another."""
        volumes = self.volume_mm3[section]
        return 1e-9 * (volumes[last] - volumes[first])

    def last_quarter_m3_s(self, section: str) -> float:
        """The mean flow rate past a section in the last quarter of the run."""
        return self.rate_m3_s(section, self.quarters()[1])

    def quarters(self) -> tuple[int, int]:
        """The samples at which the third and the last quarter of the run begin."""
        return self.sample_at(0.5 * self.end_s), self.sample_at(0.75 * self.end_s)


@dataclass(frozen=True)
class Answer:
    """What a finished run said.

    Attributes
    ----------
    verdict, reasons
        As in its ``results.json``.
    flow_m3_s
        Section to the flow rate of particles.
    velocity_m_s
        Of the flowing particles.
    velocity_range_m_s
        Its smallest and largest value over the second half of the run; None where nothing flowed.
    reached_s
        Section to the time at which the first particle had passed it; None: none has.
    inside, flowing
        How many particles were in the specimen at the end, and how many of them flowed.
    curves
        Volumes and piston in time.
    cost
        ``cpu_s``, ``wall_s``, ``simulated_s``, ``step_s``, ``ranks``, ``particles``.
    provenance
        ``deck_sha256``, ``engine``, ``liggghts_driver``, ``started``, ``machine``.
    faster_m_s
        The mean velocity of what is faster than some share of free flight (``speeds``); empty
        where no frames were left when the run was collected.
    """

    verdict: str
    reasons: list[str]
    flow_m3_s: Mapping[str, Measured]
    velocity_m_s: Measured
    velocity_range_m_s: tuple[float, float] | None
    reached_s: Mapping[str, float | None]
    inside: int
    flowing: int
    curves: Curves
    cost: Mapping[str, Any]
    provenance: Mapping[str, Any]
    faster_m_s: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Point:
    """A point of a sweep: ``state`` is done, failed, or unfinished, with the reason in ``why``."""

    values: Mapping[str, Any]
    replicate: int
    seed: int
    ranks: int
    run: str
    scene_sha256: str
    state: str = "unfinished"
    why: str = NOT_RUN
    answer: Answer | None = None

    @property
    def sound(self) -> Answer | None:
        """Its answer, unless a check speaks against it; None too without any."""
        found = self.answer
        return None if found is None or found.verdict == "invalid" else found


@dataclass(frozen=True)
class SweepResults:
    """A sweep: its title, the settings that all its points share, and the points."""

    name: str
    title: str
    settings: Mapping[str, Any]
    points: tuple[Point, ...]


@dataclass(frozen=True)
class Stored:
    """All sweeps, by name."""

    sweeps: Mapping[str, SweepResults] = field(default_factory=dict)

    def points(self, *names: str) -> Iterator[Point]:
        """The points of some sweeps, of all without a name."""
        for name in names or self.sweeps:
            if name in self.sweeps:
                yield from self.sweeps[name].points


def to_text(stored: Stored) -> str:
    """JSON, a line for each point."""
    lines = [f'{{"form": {FORM}, "sweeps": [']
    last = len(stored.sweeps) - 1
    for number, sweep in enumerate(stored.sweeps.values()):
        head = {"name": sweep.name, "title": sweep.title, "settings": dict(sweep.settings)}
        lines.append(f'{json.dumps(head, allow_nan=False)[:-1]}, "points": [')
        points = [json.dumps(asdict(point), allow_nan=False) for point in sweep.points]
        lines.append(",\n".join(points))
        lines.append("]}" if number == last else "]},")
    return "\n".join([*lines, "]}"]) + "\n"


def from_text(text: str) -> Stored:
    """What ``to_text`` wrote.

    Raises
    ------
    ValueError
        If it is not.
    """
    data = json.loads(text)
    if data.get("form") != FORM:
        raise ValueError(f"form {data.get('form')!r} instead of {FORM}")
    sweeps = [
        SweepResults(
            each["name"], each["title"], each["settings"], tuple(map(_point, each["points"]))
        )
        for each in data["sweeps"]
    ]
    return Stored({sweep.name: sweep for sweep in sweeps})


def write_stored(stored: Stored, path: Path) -> None:
    """Write the file, whole or not at all."""
    write_text(path, to_text(stored))


def read_stored(path: Path) -> Stored:
    """Read the file; nothing is stored where there is none.

    Raises
    ------
    ParseError
        If it is no such file.
    """
    if not path.exists():
        return Stored()
    try:
        return from_text(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, LookupError, TypeError, AttributeError) as error:
        raise ParseError(
            f"{path}: not what `study paper` stores ({type(error).__name__}: {error}); get it "
            "back, or move it away to begin anew"
        ) from None


def _point(data: Mapping[str, Any]) -> Point:
    answer = data["answer"]
    return Point(**{**data, "answer": None if answer is None else _answer(answer)})


def _answer(data: Mapping[str, Any]) -> Answer:
    velocity_range = data["velocity_range_m_s"]
    parts = {
        "flow_m3_s": {name: Measured(**found) for name, found in data["flow_m3_s"].items()},
        "velocity_m_s": Measured(**data["velocity_m_s"]),
        "velocity_range_m_s": None if velocity_range is None else tuple(velocity_range),
        "curves": Curves(**data["curves"]),
    }
    return Answer(**{**data, **parts})
