"""The plan of a sweep: every point, its values, its seed and its run; made once, then read."""

from __future__ import annotations

import hashlib
import itertools
import json
from dataclasses import astuple, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from liggghts_driver.errors import RunFolderError, SweepError
from liggghts_driver.outputs import require_free_names, write_text
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.scene.canonical import canonical_json
from liggghts_driver.sweeps.cost import Cost
from liggghts_driver.sweeps.draft import draft, scene_with
from liggghts_driver.sweeps.model import SlurmSettings

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from liggghts_driver.scene.model import Scene
    from liggghts_driver.sweeps.draft import Combination

#: Name of the plan in the folder of a sweep.
PLAN_FILE = "sweep.json"
#: What is made of the results, beside it.
COLLECTED_FILES = (
    "results.csv", "pooled.csv", "results.parquet", "pooled.parquet", "figures", "sweep.html",
)  # fmt: skip
#: Columns of the points in that file, in the order of `Point` but for index and values.
_COLUMNS = ("run", "replicate", "seed", "ranks", "nodes", "walltime_s")


@dataclass(frozen=True, slots=True)
class Point:
    """One point of a sweep.

    Attributes
    ----------
    index
        Its number in the sweep, from 0.
    run
        Name of its run directory: the start of its scene's hash. Points of one scene share a run.
    values
        Key of the scene, for each that varies, to its value.
    replicate, seed
        Which repetition it is, from 0, and the seed of that.
    ranks, nodes, walltime_s
        What its job is given; None for the time limit of the cluster.
    """

    index: int
    run: str
    values: Mapping[str, Any]
    replicate: int
    seed: int
    ranks: int
    nodes: int
    walltime_s: float | None


@dataclass(frozen=True)
class Plan:
    """A sweep, resolved.

    Attributes
    ----------
    title, source
        Of the sweep, and the name of its file.
    base
        Tables of the scene that varies, ``[set]`` and overrides applied.
    axes
        The keys of the scene that vary, in the order of the file.
    points
        All points of replicate 0, then those of the next; the last axis varies fastest.
    retries, pack
        How often a point that failed is tried again; points in one job.
    slurm
        What jobs of a cluster need.
    costs
        Name of a run to what it is expected to cost, as far as that is known.
    file, file_sha256
        Where the file was, and the hash of what was in it; empty where that is not known.
    """

    title: str
    source: str
    base: Mapping[str, Any]
    axes: tuple[str, ...]
    points: tuple[Point, ...]
    retries: int
    pack: int
    slurm: SlurmSettings
    costs: Mapping[str, Cost] = field(default_factory=dict)
    file: str = ""
    file_sha256: str = ""

    def scene(self, point: Point) -> Scene:
        """The scene of a point.

        Raises
        ------
        SceneError
            If it is none; it was when the plan was made.
        """
        return scene_with(self.base, {**point.values, "seed": point.seed}, f"point {point.index}")


def make_plan(path: str | Path, overrides: Sequence[str] = ()) -> Plan:
    """Read a sweep file and make every point of it; every scene is checked.

    Parameters
    ----------
    path
        The sweep file.
    overrides
        ``section.key=value`` each, of the scene that varies; they go before ``[set]``.

    Raises
    ------
    SweepError
        With every mistake of the sweep file, the scene and the points in one message.
    """
    path = Path(path)
    made = draft(path, overrides)
    sweep = made.sweep
    return Plan(
        title=sweep.title or path.stem,
        source=path.name,
        base=made.base,
        axes=made.keys,
        points=_points(made.combinations, sweep.replicates),
        retries=sweep.resources.retries,
        pack=sweep.resources.pack,
        slurm=made.slurm,
        costs={run: each.cost for each in made.combinations for _, run in each.runs},
        file=str(path.absolute()),
        file_sha256=_sha256(path),
    )


def has_changed(plan: Plan) -> bool:
    """Whether the file of a sweep holds something else than when its plan was made.

    Of a file that is gone, or that an older version made a plan of, that is not known.
    """
    try:
        return bool(plan.file_sha256) and _sha256(Path(plan.file)) != plan.file_sha256
    except OSError:
        return False


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _points(made: Sequence[Combination], replicates: int) -> tuple[Point, ...]:
    """All combinations in turn for one seed, then for the next: what comes first spans the axes."""
    turns = itertools.product(range(replicates), made)
    return tuple(
        Point(
            index=index,
            run=each.runs[replicate][1],
            values=each.values,
            replicate=replicate,
            seed=each.runs[replicate][0],
            ranks=each.resources.ranks,
            nodes=each.resources.nodes,
            walltime_s=each.resources.walltime_s,
        )
        for index, (replicate, each) in enumerate(turns)
    )


def write_plan(plan: Plan, folder: Path) -> None:
    """Keep a plan in the folder of its sweep; one that is there already is only added to.

    Raises
    ------
    RunFolderError
        If the folder cannot be made, holds a plan with runs that this one has not, or files of
        other makers that a sweep would overwrite.
    """
    path, text = folder / PLAN_FILE, _to_text(plan)
    require_free_names(folder, COLLECTED_FILES, ours=path.exists())
    RunDirectory(folder).make_or_find_empty()
    if path.exists():
        if path.read_text(encoding="utf-8") == text:
            return
        _require_extended(path, plan)
    write_text(path, text)


def _require_extended(path: Path, plan: Plan) -> None:
    try:
        old = {point.run for point in read_plan(path.parent).points}
    except SweepError as error:
        raise RunFolderError(f"{error}; choose another folder with --out") from None
    lost = old - {point.run for point in plan.points}
    if lost:
        raise RunFolderError(
            f"{path.parent}: holds the plan of another sweep, {len(lost)} of its {len(old)} runs "
            "are not in this one; choose another folder with --out"
        )


def _to_text(plan: Plan) -> str:
    """A plan as JSON: points as columns, equal values and costs once, so that it loads quickly."""
    rows = ([point.values[key] for key in plan.axes] for point in plan.points)
    values, of_values = _once(rows)
    known = {run: astuple(cost) for run, cost in plan.costs.items()}
    costs, of_costs = _once(known.get(point.run, ()) for point in plan.points)
    columns = {name: [getattr(point, name) for point in plan.points] for name in _COLUMNS}
    data = {
        "title": plan.title,
        "source": plan.source,
        "file": plan.file,
        "file_sha256": plan.file_sha256,
        "base": plan.base,
        "axes": plan.axes,
        "retries": plan.retries,
        "pack": plan.pack,
        "slurm": plan.slurm.model_dump(mode="json"),
        "values": [[row[place] for row in values] for place in range(len(plan.axes))],
        "costs": costs,
        "points": {**columns, "values": of_values, "cost": of_costs},
    }
    return json.dumps(data, separators=(",", ":"), allow_nan=False) + "\n"


def _once(rows: Iterable[Sequence[Any]]) -> tuple[list[Sequence[Any]], list[int]]:
    """Equal rows once, and which of them each was."""
    numbers: dict[str, int] = {}
    different: list[Sequence[Any]] = []
    which = []
    for row in rows:
        number = numbers.setdefault(canonical_json(row), len(different))
        if number == len(different):
            different.append(row)
        which.append(number)
    return different, which


def read_plan(folder: Path) -> Plan:
    """Read the plan in the folder of a sweep; nothing is checked again.

    Raises
    ------
    SweepError
        If the folder holds none.
    """
    path = folder / PLAN_FILE
    try:
        return _from_data(json.loads(path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        raise SweepError(
            f"{path}: not there; give the folder that `sweep run` names, or run the sweep first"
        ) from None
    except (OSError, ValueError, KeyError, TypeError, IndexError) as error:
        raise SweepError(f"{path}: no plan of a sweep ({type(error).__name__}: {error})") from None


def _from_data(data: Mapping[str, Any]) -> Plan:
    axes, columns = tuple(data["axes"]), data["points"]
    rows = zip(*data["values"], strict=True) if axes else [()]
    values = [dict(zip(axes, row, strict=True)) for row in rows]
    costs = [Cost(*row) if row else None for row in data["costs"]]
    runs = columns["run"]
    of_values = [values[number] for number in columns["values"]]
    others = [columns[name] for name in _COLUMNS[1:]]
    of_runs = zip(runs, columns["cost"], strict=True)
    return Plan(
        title=data["title"],
        source=data["source"],
        base=data["base"],
        axes=axes,
        points=tuple(map(Point, range(len(runs)), runs, of_values, *others)),
        retries=data["retries"],
        pack=data["pack"],
        slurm=SlurmSettings.model_validate(data["slurm"]),
        costs={run: cost for run, number in of_runs if (cost := costs[number]) is not None},
        file=data.get("file", ""),
        file_sha256=data.get("file_sha256", ""),
    )
