"""What accuracy costs in time: a sweep of settings, each held against a reference."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from liggghts_driver.errors import SceneError
from liggghts_driver.results.plain import number_or_nan
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.scene.layout import layout
from liggghts_driver.studies.knobs import REFERENCE, Setting
from liggghts_driver.studies.paired import Change, paired_change
from liggghts_driver.studies.tasks import core_s
from liggghts_driver.sweeps.work import is_done

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from liggghts_driver.scene.model import Scene
    from liggghts_driver.sweeps.task import Task

#: Windows after half of the run, as shares of the whole: a run could end with them.
_WINDOWS = (0.125, 0.25)
#: Instants at which accumulated volumes are compared, as shares of the run.
_INSTANTS = (0.25, 0.5, 1.0)


@dataclass(frozen=True)
class Measured:
    """One setting with one seed: what came out, per area where it goes with that, and its cost.

    Attributes
    ----------
    numbers
        By name; rates and volumes per area of the section.
    core_s_per_s
        Core time for a simulated second.
    """

    setting: Setting
    seed: int
    numbers: Mapping[str, float]
    core_s_per_s: float


@dataclass(frozen=True)
class Judged:
    """A setting beside the reference.

    Attributes
    ----------
    cost
        Its core time over the reference's, the median over the seeds.
    core_s_per_s
        Its core time for a simulated second, the median over the seeds.
    errors
        Relative errors by name, means over the seeds.
    overlap_over_radius
        The largest of all seeds.
    """

    setting: Setting
    cost: float
    core_s_per_s: float
    errors: Mapping[str, Change]
    overlap_over_radius: float

    def reach(self, name: str) -> float:
        """How far the interval of an error reaches from zero; infinite where it is not known."""
        change = self.errors.get(name)
        if change is None or change.ci95 is None:
            return math.inf
        return abs(change.mean) + change.ci95

    def is_below_noise(self, name: str) -> bool:
        """Whether an error cannot be told from none; with one replicate none can."""
        change = self.errors[name]
        return change.ci95 is None or abs(change.mean) <= change.ci95


def require_flow(scene: Scene) -> None:
    """Refuse a scene in which nothing flows through a specimen.

    Raises
    ------
    SceneError
        If it has none.
    """
    if scene.specimen is None:
        raise SceneError(
            "[specimen] (missing): the study compares flow rates; give a scene with it"
        )


def measure(scene: Scene, tasks: Mapping[tuple[Setting, int], Task]) -> list[Measured]:
    """What the finished runs say; windows of the reference's own runs among it."""
    found: list[Measured] = []
    for (setting, seed), task in tasks.items():
        if is_done(task.folder):
            run = RunDirectory(task.folder)
            found += _measured(setting.scene(scene, seed), setting, seed, run)
    return found


def judge(measured: Sequence[Measured]) -> list[Judged]:
    """Each setting's mean error over the seeds it shares with the reference, and its cost."""
    reference = {m.seed: m for m in measured if m.setting is REFERENCE}
    settings = dict.fromkeys(m.setting.title for m in measured)
    by_title = {title: [m for m in measured if m.setting.title == title] for title in settings}
    return [_judged(own, reference) for own in by_title.values() if reference]


def noise(measured: Sequence[Measured], name: str) -> float:
    """Half the 95 % interval of the reference's mean over its seeds, over the mean."""
    own = [m for m in measured if m.setting is REFERENCE and name in m.numbers]
    values = {m.seed: m.numbers[name] for m in own}
    if len(values) < 2:
        return float("nan")
    mean = float(np.mean(list(values.values())))
    change = paired_change(values, dict.fromkeys(values, mean))
    return change.ci95 if change and change.ci95 is not None else float("nan")


def pareto(judged: Sequence[Judged], name: str) -> list[Judged]:
    """Settings that nothing cheaper beats, from the cheapest on, by how far their errors reach.

    By the errors alone the front would be made of those that chance favoured. What has no interval
    is not in it.
    """
    front: list[Judged] = []
    for each in sorted(judged, key=lambda j: j.cost):
        reach = each.reach(name)
        if reach < (front[-1].reach(name) if front else math.inf):
            front.append(each)
    return front


def _measured(scene: Scene, setting: Setting, seed: int, run: RunDirectory) -> Iterator[Measured]:
    results = json.loads(run.results.read_text(encoding="utf-8"))
    series = pd.read_csv(run.series)
    cost = core_s(results["cost"]) / float(series["time_s"].iloc[-1])
    values = _values(scene, series) | {"overlap": number_or_nan(results["max_overlap_over_radius"])}
    yield Measured(setting, seed, values, cost)
    if setting is REFERENCE:
        for share in _WINDOWS:
            title = f"window of {share:g} of the run"
            window = Setting("window", share, title)
            shorter = _values(scene, series, 0.5 + share)
            yield Measured(window, seed, values | shorter, cost * (0.5 + share))


def _values(scene: Scene, series: pd.DataFrame, end: float = 1.0) -> dict[str, float]:
    """Numbers of a series up to a share of its time; rates are those after half of it."""
    place = layout(scene)
    time = series["time_s"].to_numpy()
    whole = time[-1]
    found = {}
    for section in place.sections:
        volume = series[f"volume_{section}_m3"].to_numpy() / place.area_m2
        half, last = np.interp([0.5 * whole, end * whole], time, volume)
        found[f"rate_{section}"] = (last - half) / ((end - 0.5) * whole)
        if end == 1.0:
            at = {share: np.interp(share * whole, time, volume) for share in _INSTANTS}
            found |= {f"volume_{section}_{share:g}": float(v) for share, v in at.items()}
    late = series[(time >= 0.5 * whole) & (time <= end * whole)]
    found["flowing_velocity"] = float(late["flowing_velocity_m_s"].mean())
    return {name: float(value) for name, value in found.items() if np.isfinite(value)}


def _judged(own: Sequence[Measured], reference: Mapping[int, Measured]) -> Judged:
    pairs = [m for m in own if m.seed in reference]
    names = dict.fromkeys(name for m in own for name in m.numbers if name != "overlap")
    errors = {}
    for name in names:
        change = paired_change(
            {m.seed: m.numbers[name] for m in pairs if name in m.numbers},
            {s: r.numbers[name] for s, r in reference.items() if name in r.numbers},
        )
        if change is not None:
            errors[name] = change
    ratios = [m.core_s_per_s / reference[m.seed].core_s_per_s for m in pairs]
    overlap = max(m.numbers.get("overlap", 0.0) for m in own)
    times = [m.core_s_per_s for m in own]
    return Judged(
        own[0].setting, float(np.median(ratios)), float(np.median(times)), errors, overlap
    )
