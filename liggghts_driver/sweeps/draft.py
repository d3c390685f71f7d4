"""What a sweep file comes to: its scene, and every combination of values with its runs."""

from __future__ import annotations

import itertools
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import ValidationError

from liggghts_driver.errors import SceneError
from liggghts_driver.identity import scene_hash
from liggghts_driver.resources import cases_dir
from liggghts_driver.scene.checks import Mistake
from liggghts_driver.scene.model import Scene
from liggghts_driver.scene.read import (
    apply_override,
    arguments_of,
    explain_detail,
    load_tables,
    make_scene,
    set_key,
)
from liggghts_driver.sweeps.accuracy import other_problems, with_settings
from liggghts_driver.sweeps.axes import (
    RESOURCE_KEYS,
    axis_mistakes,
    combinations,
    keys_of,
    point_count,
    shared_mistakes,
)
from liggghts_driver.sweeps.cost import predict_cost
from liggghts_driver.sweeps.model import Gathered, Resources, mistaken, read_sweep

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from liggghts_driver.sweeps.cost import Cost
    from liggghts_driver.sweeps.model import Axis, SlurmSettings, Sweep, SweepFile

#: A sweep of more points is a slip of the pen, and its plan would not fit comfortably in memory.
_MOST_POINTS = 1_000_000
#: Hexadecimal digits of a scene's hash that name its run: odds of a clash in a million, 3e-8.
_NAME_DIGITS = 16


@dataclass(frozen=True)
class Combination:
    """One combination of values: what its points have in common, and their runs.

    Attributes
    ----------
    values
        Key of the scene to its value.
    resources
        What its jobs are given.
    cost
        Of one of its runs.
    runs
        Seed and name of the run of each replicate.
    """

    values: dict[str, Any]
    resources: Resources
    cost: Cost
    runs: tuple[tuple[int, str], ...]


@dataclass(frozen=True)
class Draft:
    """A faultless sweep file, and all that it comes to.

    Attributes
    ----------
    sweep
        As the file says.
    base
        Tables of its scene, ``[set]`` and overrides applied.
    slurm
        Its settings, the template found.
    keys
        Those of the scene that vary.
    combinations
        In the order of the file, the last axis varies fastest.
    """

    sweep: Sweep
    base: dict[str, Any]
    slurm: SlurmSettings
    keys: tuple[str, ...]
    combinations: list[Combination]


def draft(path: Path, overrides: Sequence[str]) -> Draft:
    """Read a sweep file and check every scene that it makes.

    Raises
    ------
    SweepError
        With every mistake of the sweep file, the scene and the points in one message.
    """
    file = read_sweep(path)
    axes = _sound_axes(file, overrides)
    slurm = _slurm(file, path.parent)
    base = _base(file, path.parent, overrides)
    axes = {} if base is None else _settable(file, axes, base)
    base = _settled(file, path.parent, overrides, axes, base)
    points = point_count(axes, file.sweep.replicates)
    keys: tuple[str, ...] = ()
    made: list[Combination] = []
    if points > _MOST_POINTS:
        bound, fix = f"must be at most {_MOST_POINTS}", "give fewer values, or a sample"
        file.mistakes.append(str(Mistake("axes", f"{points} points", bound, fix)))
    elif base is not None:
        keys, made = _combinations(file, axes, base)
    if base is None or file.mistakes:
        raise mistaken(file.name, file.mistakes)
    return Draft(file.sweep, base, slurm, keys, made)


def _sound_axes(file: SweepFile, overrides: Sequence[str]) -> dict[int, Axis]:
    """The axes that are faultless by themselves."""
    faults = {number: axis_mistakes(number, axis) for number, axis in file.axes.items()}
    fixed = dict.fromkeys(file.sweep.settings, "in [set]")
    fixed |= {_name_of(text): "in --set" for text in overrides}
    shared = shared_mistakes(file.axes, fixed, file.sweep)
    file.mistakes.extend(str(found) for found in itertools.chain(*faults.values(), shared))
    return {number: axis for number, axis in file.axes.items() if not faults[number]}


def _settable(
    file: SweepFile, axes: Mapping[int, Axis], base: Mapping[str, Any]
) -> dict[int, Axis]:
    """The axes whose keys can be keys of the scene."""
    sound = {}
    for number, axis in axes.items():
        blocked = {key: part for key in keys_of(axis) if (part := set_key(_copy(base), key, 0))}
        for key, part in blocked.items():
            bound, fix = f"{part} is not a table", "vary a key of a table"
            file.mistakes.append(str(Mistake(f"axes[{number}]", key, bound, fix)))
        if not blocked:
            sound[number] = axis
    return sound


def _name_of(override: str) -> str:
    return ".".join(part.strip() for part in override.partition("=")[0].split("."))


def _slurm(file: SweepFile, folder: Path) -> SlurmSettings:
    """The settings, the template found."""
    slurm = file.sweep.slurm
    if slurm.template is None:
        return slurm
    template = (folder / slurm.template).resolve()
    if not _is_file(template):
        bound = f"there is no file {template}"
        fix = "give its path, seen from the sweep file"
        file.mistakes.append(str(Mistake("slurm.template", slurm.template, bound, fix)))
    return slurm.model_copy(update={"template": str(template)})


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # a name that no file can have
        return False


def _base(file: SweepFile, folder: Path, overrides: Sequence[str]) -> dict[str, Any] | None:
    """Tables of the scene that varies, settings and overrides applied; None without a scene."""
    sweep, mistakes = file.sweep, file.mistakes
    try:
        tables = load_tables(_scene_file(sweep, folder))
    except SceneError as error:
        mistakes.append(f"scene = {sweep.scene!r}: {error}")
        return None
    for name, value in sweep.settings.items():
        if (blocked := set_key(tables, name, value)) is not None:
            bound, fix = f"{blocked} is not a table", "set a key of a table"
            mistakes.append(str(Mistake(f"set.{name}", value, bound, fix)))
    mistakes.extend(fault for text in overrides if (fault := apply_override(tables, text)))
    return tables


def _scene_file(sweep: Sweep, folder: Path) -> Path:
    beside, shipped = folder / sweep.scene, cases_dir() / f"{sweep.scene}.toml"
    return shipped if _is_file(shipped) and not _is_file(beside) else beside


def _settled(
    file: SweepFile,
    folder: Path,
    overrides: Sequence[str],
    axes: Mapping[int, Axis],
    base: dict[str, Any] | None,
) -> dict[str, Any] | None:
    """The tables with the settings that their accuracy comes to; None where it comes to none."""
    if base is None or "accuracy" not in base:
        return base
    names = [name for axis in axes.values() for name in keys_of(axis)]
    file.mistakes.extend(str(found) for found in other_problems(base["accuracy"], names))
    given = [f"{n}={json.dumps(v, default=str)}" for n, v in file.sweep.settings.items()]
    arguments = arguments_of(_scene_file(file.sweep, folder), [*given, *overrides])
    try:
        return with_settings(base, arguments)
    except SceneError as error:
        lines = [line.removeprefix("  - ") for line in str(error).splitlines()[1:]]
        file.mistakes.extend(f"the scene without its axes: {line}" for line in lines)
        return None


def _combinations(
    file: SweepFile, axes: Mapping[int, Axis], base: Mapping[str, Any]
) -> tuple[tuple[str, ...], list[Combination]]:
    """The keys of the scene that vary, and every combination that is a scene."""
    own = base.get("seed", Scene.model_fields["seed"].default)
    own = own if isinstance(own, int) and own >= 0 else 0  # the scene's check tells of others
    names, rows = combinations(axes, own if file.sweep.root_seed is None else file.sweep.root_seed)
    seeds = () if "seed" in names else replicate_seeds(file.sweep, own)
    gathered, made = Gathered(), []
    for row in rows:
        values = dict(zip(names, row, strict=True))
        given = {name: values[name] for name in RESOURCE_KEYS if name in values}
        own = {name: value for name, value in values.items() if name not in given}
        resources = file.sweep.resources
        with gathered.at(values):
            resources = _resources(resources, given) if given else resources
        with gathered.at(values):
            made.append(_combination(base, own, resources, seeds))
    file.mistakes.extend(gathered.lines(len(rows), file.sweep.replicates))
    return tuple(name for name in names if name not in RESOURCE_KEYS), made


def _combination(
    base: Mapping[str, Any], values: dict[str, Any], resources: Resources, seeds: Sequence[int]
) -> Combination:
    scene = scene_with(base, values)
    runs = tuple((seed, run_name(scene, seed)) for seed in seeds or (scene.seed,))
    return Combination(values, resources, predict_cost(scene), runs)


def scene_with(base: Mapping[str, Any], values: Mapping[str, Any], source: str = "scene") -> Scene:
    """The scene of some tables with keys set.

    Raises
    ------
    SceneError
        Naming everything wrong with it.
    """
    tables = _copy(base)
    for name, value in values.items():
        set_key(tables, name, value)
    return make_scene(tables, source)


def _copy(tables: Any) -> Any:
    """A copy that shares no table or list; ``copy.deepcopy`` takes five times as long."""
    if isinstance(tables, dict):
        return {name: _copy(value) for name, value in tables.items()}
    return [_copy(value) for value in tables] if isinstance(tables, list) else tables


def _resources(shared: Resources, given: Mapping[str, Any]) -> Resources:
    changes = {name.removeprefix("resources."): value for name, value in given.items()}
    try:
        return Resources.model_validate(shared.model_dump() | changes)
    except ValidationError as error:
        lines = [f"resources.{explain_detail(detail, Resources)}" for detail in error.errors()]
        raise SceneError("\n".join(["resources", *lines])) from None


def run_name(scene: Scene, seed: int) -> str:
    """The name of the run of a scene with a seed, which all sweeps and studies find it by."""
    return scene_hash(scene.model_copy(update={"seed": seed}))[:_NAME_DIGITS]


def replicate_seeds(sweep: Sweep, own: int) -> tuple[int, ...]:
    """The seed of each replicate; more replicates leave those of the first as they are.

    Without ``root_seed`` the first is the scene's own, so that its run is found again.
    """
    root = own if sweep.root_seed is None else sweep.root_seed
    # Words of 32 bits may come twice, and no replicate must be the double of another.
    words = np.random.SeedSequence(root).generate_state(2 * sweep.replicates).tolist()
    first = [own] if sweep.root_seed is None else []
    return tuple(dict.fromkeys([*first, *words]))[: sweep.replicates]
