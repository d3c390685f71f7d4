"""The axes of a sweep: what is wrong with them, and the combinations of values that they make."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Any, get_args

import numpy as np

from liggghts_driver.scene.checks import Mistake
from liggghts_driver.scene.model import Scene, table_class
from liggghts_driver.sweeps.model import EVERY_KEY, Axis, Resources

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from numpy.typing import NDArray
    from pydantic import BaseModel

    from liggghts_driver.sweeps.model import Scale, Sweep

#: Keys of resources that may differ from point to point.
RESOURCE_KEYS = ("resources.ranks", "resources.nodes", "resources.walltime_s")
#: Digits that are kept of a computed value, so that 0.3 is 0.3 and not 0.30000000000000004.
_DIGITS = 12

#: The forms of an axis: the keys that each needs, and those that it may have besides.
_FORMS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "list": (("key", "values"), ()),
    "combination": (("keys", "values"), ()),
    "range": (("key", "from", "to", "count"), ("scale",)),
    "sample": (("sample", "count", "ranges"), ("scale",)),
}


def keys_of(axis: Axis) -> tuple[str, ...]:
    """The keys that vary along an axis."""
    if axis.ranges:
        return tuple(axis.ranges)
    return axis.keys or ((axis.name,) if axis.name else ())


def size_of(axis: Axis) -> int:
    """How many rows of values an axis has."""
    return len(axis.values) if axis.count is None else axis.count


def _given(axis: Axis) -> dict[str, Any]:
    """What the file says of an axis, by the names of the file."""
    fields = Axis.model_fields
    return {fields[name].alias or name: getattr(axis, name) for name in axis.model_fields_set}


def _form(given: Mapping[str, Any]) -> str:
    if "sample" in given or "ranges" in given:
        return "sample"
    if "keys" in given:
        return "combination"
    ranged = "values" not in given and {"from", "to", "count", "scale"} & set(given)
    return "range" if ranged else "list"


def axis_mistakes(number: int, axis: Axis) -> list[Mistake]:
    """Everything wrong with one axis by itself."""
    given = _given(axis)
    form = _form(given)
    needed, allowed = _FORMS[form]
    has = f"a {form} has {', '.join(needed)}"
    missing = [name for name in needed if name not in given]
    foreign = [name for name in given if name not in (*needed, *allowed)]
    where = f"axes[{number}]"
    found = [Mistake(f"{where}.{name}", None, has, "give it") for name in missing]
    found += [
        Mistake(f"{where}.{name}", _short(given[name]), f"belongs to another form; {has}", "remove")
        for name in sorted(foreign)
    ]
    checks = {"combination": _rows, "range": _range, "sample": _sample, "list": _list}
    return found or [*_resources(where, axis), *_accuracy(where, axis), *checks[form](where, axis)]


def _short(value: Any) -> Any:
    return dict(value) if isinstance(value, dict) else value


def _resources(where: str, axis: Axis) -> Iterator[Mistake]:
    for name in keys_of(axis):
        if name.startswith("resources.") and name not in RESOURCE_KEYS:
            valid = ", ".join(RESOURCE_KEYS)
            yield Mistake(where, name, "is the same for all points", f"use one of {valid}")


def _accuracy(where: str, axis: Axis) -> Iterator[Mistake]:
    """Its settings are written into the sweep's plan, once for all points."""
    for name in keys_of(axis):
        if name.partition(".")[0] == "accuracy":
            fix = "give it in the scene or in [set]; `study accuracy` compares settings"
            yield Mistake(where, name, "is the same for all points", fix)


def _list(where: str, axis: Axis) -> Iterator[Mistake]:
    if not axis.values:
        yield Mistake(f"{where}.values", [], "no points", "give at least one value")


def _rows(where: str, axis: Axis) -> Iterator[Mistake]:
    yield from _list(where, axis)
    if not axis.keys:
        yield Mistake(f"{where}.keys", [], "nothing varies", "give at least one key")
    width = len(axis.keys)
    for number, row in enumerate(axis.values):
        if not isinstance(row, list) or len(row) != width:
            bound = f"a row has one value for each of the {width} keys"
            yield Mistake(f"{where}.values[{number}]", row, bound, f"give {width} values")


def _range(where: str, axis: Axis) -> Iterator[Mistake]:
    yield from _scales(where, axis)
    assert axis.name is not None
    if axis.scale_of(axis.name) == "log":
        ends = {"from": axis.first, "to": axis.last}
        for name, value in ends.items():
            if value is not None and value <= 0:
                yield _not_positive(f"{where}.{name}", value)


def _not_positive(name: str, value: object) -> Mistake:
    return Mistake(name, value, "a log scale needs numbers above 0", 'use scale = "linear"')


def _scales(where: str, axis: Axis) -> Iterator[Mistake]:
    for name in axis.scale:
        if name not in (EVERY_KEY, *keys_of(axis)):
            fix = f"name one of {', '.join(keys_of(axis))}"
            yield Mistake(f"{where}.scale", name, "does not vary on this axis", fix)


def _sample(where: str, axis: Axis) -> Iterator[Mistake]:
    yield from _scales(where, axis)
    if not axis.ranges:
        yield Mistake(
            f"{where}.ranges", {}, "nothing varies", "give at least one key = [low, high]"
        )
    for name, (low, high) in axis.ranges.items():
        if not low < high:
            bound = "the first number must be below the second"
            yield Mistake(f"{where}.ranges.{name}", [low, high], bound, "give [low, high]")
        if low <= 0 and axis.scale_of(name) == "log":
            yield _not_positive(f"{where}.ranges.{name}", [low, high])
    count = size_of(axis)
    if axis.sample == "sobol" and count & (count - 1):
        below = 1 << (count.bit_length() - 1)
        fix = f"give {below} or {2 * below}"
        yield Mistake(f"{where}.count", count, "Sobol points are balanced by powers of two", fix)


def shared_mistakes(
    axes: Mapping[int, Axis], fixed: Mapping[str, str], sweep: Sweep
) -> Iterator[Mistake]:
    """What is wrong with the axes together, and beside keys that are fixed elsewhere.

    Parameters
    ----------
    axes
        By number.
    fixed
        Keys that have one value, and where it was given: ``{"time.duration": "in [set]"}``.
    sweep
        For its seed and replicates.
    """
    named = [(key, f"on axes[{n}]") for n, axis in axes.items() for key in keys_of(axis)]
    for number, (name, place) in enumerate(named):
        clashes = [pair for pair in named[number + 1 :] if _within(*sorted((name, pair[0])))]
        # A list in [set] may well have a key that varies, as a sphere's radius.
        clashes += [pair for pair in fixed.items() if _within(name, pair[0])]
        for other, elsewhere in clashes:
            both = name if name == other else f"{name}, {other}"
            fix = "let it stand in one place only"
            yield Mistake(both, "given twice", f"stands {place} and {elsewhere}", fix)
    if sweep.replicates > 1 and "seed" in dict(named):
        bound = f"each of {sweep.replicates} replicates has a seed of its own"
        yield Mistake("seed", "an axis", bound, "remove the axis, or replicates")
    if sweep.root_seed is not None and "seed" in fixed:
        bound = f"stands {fixed['seed']}, and the seeds come from root_seed"
        yield Mistake("seed", "given twice", bound, "remove one of the two")


def point_count(axes: Mapping[int, Axis], replicates: int) -> int:
    """How many points there will be."""
    return math.prod(size_of(axis) for axis in axes.values()) * replicates


def _within(table: str, name: str) -> bool:
    """Whether a key is that of a table, or in it."""
    return name == table or name.startswith((f"{table}.", f"{table}["))


def combinations(
    axes: Mapping[int, Axis], root_seed: int
) -> tuple[tuple[str, ...], list[tuple[Any, ...]]]:
    """Every combination of the values of all axes.

    Returns
    -------
    tuple[tuple[str, ...], list[tuple[Any, ...]]]
        The keys, in the order of the file, and rows of their values; the last axis varies fastest.
    """
    names = tuple(name for axis in axes.values() for name in keys_of(axis))
    factors = [_values(axis, number, root_seed) for number, axis in axes.items()]
    rows = [tuple(itertools.chain(*parts)) for parts in itertools.product(*factors)]
    return names, rows


def _values(axis: Axis, number: int, root_seed: int) -> list[tuple[Any, ...]]:
    """Rows of one axis, one value for each of its keys."""
    if axis.sample is not None:
        return _sampled(axis, number, root_seed)
    if axis.keys:
        return [tuple(row) for row in axis.values]
    if axis.count is None:
        return [(value,) for value in axis.values]
    assert axis.name is not None
    assert axis.first is not None
    assert axis.last is not None
    shares = np.linspace(0.0, 1.0, axis.count)
    scale = axis.scale_of(axis.name)
    return [(value,) for value in spread(shares, axis.first, axis.last, scale, axis.name)]


def _sampled(axis: Axis, number: int, root_seed: int) -> list[tuple[Any, ...]]:
    from scipy.stats import qmc  # most sweeps need none of it, and it takes half a second

    # Its own stream: another axis, or more replicates, change no sample.
    seed = np.random.default_rng(np.random.SeedSequence(root_seed, spawn_key=(number,)))
    count = size_of(axis)
    if axis.sample == "sobol":
        shares = qmc.Sobol(len(axis.ranges), seed=seed).random_base2(count.bit_length() - 1)
    else:
        shares = qmc.LatinHypercube(len(axis.ranges), seed=seed).random(count)
    columns = [
        spread(shares[:, column], low, high, axis.scale_of(name), name)
        for column, (name, (low, high)) in enumerate(axis.ranges.items())
    ]
    return list(zip(*columns, strict=True))


def spread(
    shares: NDArray[np.float64], first: float, last: float, scale: Scale, name: str
) -> Sequence[float | int]:
    """Values at shares of the way from ``first`` to ``last``; whole for a key of whole numbers.

    Parameters
    ----------
    shares
        ``(n,)``, from 0 to 1.
    first, last
        The ends, in the unit of the key.
    scale
        How the way is measured: by differences, or by ratios.
    name
        The key.
    """
    ratio = scale == "log"
    raw = first * (last / first) ** shares if ratio else first + (last - first) * shares
    low, high = sorted((first, last))
    if _is_whole(name):
        return [int(v) for v in np.clip(np.rint(raw), math.ceil(low), math.floor(high))]
    return [min(max(float(f"{value:.{_DIGITS}g}"), low), high) for value in raw.tolist()]


def _is_whole(name: str) -> bool:
    """Whether a key takes whole numbers alone."""
    first, *rest = [part.partition("[")[0] for part in name.split(".")]
    table: type[BaseModel] | None = Scene
    if first == "resources":
        table, (first, *rest) = Resources, rest
    for inner in rest:
        field = table.model_fields.get(first) if table else None
        table, first = table_class(field.annotation) if field else None, inner
    last = table.model_fields.get(first) if table else None
    return last is not None and _holds_int(last.annotation)


def _holds_int(annotation: Any) -> bool:
    return annotation is int or any(_holds_int(part) for part in get_args(annotation))
