"""Job scripts: which points share an array, and the text that sbatch is given."""

from __future__ import annotations

import math
import re
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import jinja2

from liggghts_driver.batch import SlurmError
from liggghts_driver.resources import templates_dir

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from liggghts_driver.sweeps.model import SlurmSettings
    from liggghts_driver.sweeps.plan import Point

_Item = TypeVar("_Item")

#: Slurm counts time limits in minutes and may send a signal a minute early: with less than this
#: the warning could come right after the start.
SHORTEST_WALLTIME_S = 180.0
#: The warning comes this share of the time limit before its end, within these bounds.
_LEAD = 0.1
_LEAD_S = (60, 120)


@dataclass(frozen=True)
class Array:
    """Points that one array runs: all need the same.

    Attributes
    ----------
    ranks, nodes
        Of each task: MPI ranks, and machines over which they are spread.
    walltime_s
        Time limit of each task; None for the one of the cluster.
    tasks
        For each task the indices of its points, in the order in which they run.
    """

    ranks: int
    nodes: int
    walltime_s: float | None
    tasks: tuple[tuple[int, ...], ...]


def group_points(points: Iterable[Point], pack: int, largest: int | None = None) -> list[Array]:
    """Put points that need the same into arrays; their order stays.

    Parameters
    ----------
    points
        What is to run.
    pack
        Points of one task, at most.
    largest
        Tasks of one array, at most.
    """
    alike: dict[tuple[int, int, float | None], list[int]] = {}
    for point in points:
        needs = (point.ranks, point.nodes, point.walltime_s)
        alike.setdefault(needs, []).append(point.index)
    return [
        Array(*needs, tuple(tasks))
        for needs, indices in alike.items()
        for tasks in _pieces(_pieces(indices, pack), largest)
    ]


def _pieces(items: Sequence[_Item], size: int | None) -> list[tuple[_Item, ...]]:
    size = size or len(items)
    return [tuple(items[start : start + size]) for start in range(0, len(items), size)]


def require_long_enough(points: Iterable[Point]) -> None:
    """Refuse time limits that Slurm cannot warn of in time.

    Raises
    ------
    SlurmError
        With the number of points that have such a limit.
    """
    short = [point for point in points if (point.walltime_s or math.inf) < SHORTEST_WALLTIME_S]
    if short:
        least = min(point.walltime_s or math.inf for point in short)
        raise SlurmError(
            f"walltime_s = {least:g} s: must be at least {SHORTEST_WALLTIME_S:g} s (points with "
            f"less: {len(short)}); Slurm counts minutes and its warning would come at the start"
        )


def signal_lead_s(walltime_s: float | None) -> int:
    """How long before its time limit a job is warned."""
    low, high = _LEAD_S
    return high if walltime_s is None else round(min(max(_LEAD * walltime_s, low), high))


def job_name(folder: Path, number: int) -> str:
    """What squeue shows: the sweep's folder and the number of the array."""
    return f"{re.sub(r'[^A-Za-z0-9_.-]+', '-', folder.absolute().name)}.{number}"


def output_of(jobs: Path, number: int) -> str:
    """Name of the outputs of an array's tasks as sbatch is given it: ``%a`` is the task.

    Raises
    ------
    SlurmError
        If the folder has a backslash in its name: Slurm then puts no task into the output's.
    """
    if "\\" in str(jobs):
        raise SlurmError(f"{jobs}: no backslash may stand in its name; choose another with --out")
    return f"{jobs}/{number}.".replace("%", "%%") + "%a.out"


def directives(array: Array, name: str, settings: SlurmSettings) -> list[str]:
    """The options of sbatch as they stand in a script.

    No path is among them, for quoting in these lines is not that of a shell: the outputs are told
    to sbatch directly.
    """
    own = {"partition": settings.partition, "account": settings.account, "qos": settings.qos}
    limit = array.walltime_s
    options = [
        f"--job-name={name}",
        f"--array=0-{len(array.tasks) - 1}",
        f"--ntasks={array.ranks}",
        f"--nodes={array.nodes}",
        *([] if limit is None else [f"--time={math.ceil(limit / 60)}"]),
        "--open-mode=append",
        "--requeue",
        f"--signal=B:USR1@{signal_lead_s(limit)}",
        *(f"--{option}={value}" for option, value in own.items() if value is not None),
        *settings.options,
    ]
    return [f"#SBATCH {option}" for option in options]


def render_script(
    lines: Sequence[str], command: Sequence[str], points: Path, template: str | None
) -> str:
    """The job script of an array.

    Parameters
    ----------
    lines
        Its options, see `directives`.
    command
        Program and arguments of the worker.
    points
        The list file, which the worker is told, as it is told the number of its task.
    template
        A site's own Jinja template; None for the shipped one. It is given ``directives``,
        ``folder`` and ``command``, both quoted for the shell.

    Raises
    ------
    SlurmError
        If the template cannot be rendered, or its script would not do what it must.
    """
    worker = f'{shlex.join([*command, "--list", str(points)])} --task "$SLURM_ARRAY_TASK_ID"'
    values = {
        "directives": "\n".join(lines),
        "folder": shlex.quote(str(Path.cwd())),
        "command": worker,
    }
    source = Path(template) if template else templates_dir() / "slurm" / "array.sh.j2"
    try:
        script = _environment(source).get_template(source.name).render(values)
    except (jinja2.TemplateError, OSError, ValueError) as error:
        number = getattr(error, "lineno", None)
        where = f"{source}, line {number}" if number else str(source)
        raise SlurmError(f"{where}: {type(error).__name__}: {error}") from None
    _require_whole(script, values["directives"], worker, source)
    return script


def _environment(source: Path) -> jinja2.Environment:
    """A Jinja environment that refuses undefined names; a site's template may extend the shipped.

    Comments have marks of their own, for ``{#`` is what a shell's ``${#name}`` has inside.
    """
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader([source.parent, templates_dir() / "slurm"]),
        undefined=jinja2.StrictUndefined,
        autoescape=False,  # noqa: S701 - a script is not HTML
        comment_start_string="{##",
        comment_end_string="##}",
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )


def _require_whole(script: str, options: str, worker: str, source: Path) -> None:
    """Refuse a script whose options sbatch would not read, or that does not become the worker."""
    before, found, after = script.partition(f"{options}\n")
    mistakes = []
    if not script.startswith("#!"):
        mistakes.append("its first line must be #! and a shell, e.g. #!/bin/sh")
    if not found or any(not line.startswith("#") for line in before.split("\n") if line.strip()):
        mistakes.append("{{ directives }} must stand alone on a line, before every command")
    if f"exec {worker}" not in (line.strip() for line in after.splitlines()):
        mistakes.append(
            "exec {{ command }} must be a line of its own below: Slurm signals only the batch "
            "process itself"
        )
    if mistakes:
        raise SlurmError("\n".join([f"{source}: no job script", *(f"  - {m}" for m in mistakes)]))
