"""Whether the hard thing happened: not where all stands still, and where it is made to happen."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
import pytest

from liggghts_driver.prepare import prepare
from liggghts_driver.scene import read_scene
from liggghts_driver.studies.energy import Ran
from liggghts_driver.studies.happenings import HAPPENINGS, Wanted, what_is_missing
from liggghts_driver.studies.hard_cases import CASES, HardCase
from liggghts_driver.studies.seen import retreats_m

if TYPE_CHECKING:
    from collections.abc import Callable

    from liggghts_driver.case import Case

FRAMES = 41
#: Goes forth by 10, back by 4, and forth and back once more.
TO_AND_FRO = np.array([0.0, 10.0, 6.0, 10.0, 6.0])


@cache
def case_of(name: str) -> Case:
    return prepare(read_scene(HardCase(name).path))


def still(name: str) -> Ran:
    """A made-up run of a hard case in which everything stays where it begins."""
    case = case_of(name)
    times = np.linspace(0.0, case.scene.time.duration, FRAMES)
    count = case.population.particles
    places = np.repeat(case.population.centres_m[None, :count], FRAMES, axis=0)
    series = {"time_s": times, "piston_x_m": 0.0 * times + case.layout.low[0]}
    return Ran(case, pd.DataFrame(series), times, places, 0.0 * places, {})


def with_piston(run: Ran, scale: float, back: float = 1.0) -> Ran:
    """The same with a piston that goes to and fro, so many radii a unit, from where it stands."""
    way = TO_AND_FRO - (1.0 - back) * np.array([0.0, 0.0, -4.0, 0.0, -4.0])
    way = np.interp(np.linspace(0.0, 4.0, FRAMES), np.arange(5), way)
    place = run.case.layout.low[0] + scale * float(run.case.population.radii_m.min()) * way
    return replace(run, series=run.series.assign(piston_x_m=place))


def flipping(run: Ran, axis: int = 0) -> Ran:
    """All fly to and fro."""
    velocities = run.velocities_m_s.copy()
    velocities[:, :, axis] = 0.01 * (-1.0) ** np.arange(FRAMES)[:, None]
    return replace(run, velocities_m_s=velocities)


def shifted(run: Ran, x_m: object, scale: float = 1.0) -> Ran:
    """All have gone by some way along x after the first frame, and all is a little smaller."""
    places = run.positions_m * scale
    places[1:, :, 0] += x_m
    return replace(run, positions_m=places)


def on_a_grain(run: Ran, x_m: float | None = None) -> Ran:
    """All are on the grain that is nearest to the section, and the piston with them."""
    centres = run.case.population.centres_m[run.case.population.particles :]
    places = run.positions_m.copy()
    places[1:] = centres[centres[:, 0].argmin()]
    if x_m is not None:
        places[1:, :, 0] = x_m
    series = run.series.assign(piston_x_m=places[-1, 0, 0])
    return replace(run, positions_m=places, series=series)


def forth_and_back(run: Ran) -> Ran:
    places = run.positions_m.copy()
    places[:, :, 0] += 0.01 * np.sin(np.linspace(0.0, 2.0 * np.pi, FRAMES))[:, None]
    return replace(run, positions_m=places)


def starting_with(run: Ran, *velocity: float) -> Ran:
    """All have this velocity at the start, and are at rest later."""
    velocities = run.velocities_m_s.copy()
    velocities[0] = velocity
    return replace(run, velocities_m_s=velocities)


def stopped(run: Ran) -> Ran:
    velocities = run.velocities_m_s.copy()
    velocities[0] = run.case.population.velocities_m_s[: velocities.shape[1]]
    return replace(run, velocities_m_s=velocities)


def flying(run: Ran) -> Ran:
    return replace(run, velocities_m_s=run.velocities_m_s + np.array([0.05, 0.0, 0.0]))


def pushed(run: Ran) -> Ran:
    velocities = run.velocities_m_s.copy()
    velocities[1:] = 0.01
    return replace(run, velocities_m_s=velocities)


def in_one_place(run: Ran) -> Ran:
    return replace(run, positions_m=0.0 * run.positions_m)


HAPPENS: dict[str, Callable[[Ran], Ran]] = {
    "micrometre_viscous": lambda run: shifted(run, 0.0, scale=0.999),
    "stiff_contacts": flipping,
    "soft_contacts": lambda run: shifted(run, 0.0, scale=0.92),
    "size_ratio_10": lambda run: shifted(run, 0.00031 * (np.arange(11) == 0)),
    "size_ratio_30": lambda run: shifted(run, 0.00031 * (np.arange(11) == 0)),
    "size_ratio_50": lambda run: shifted(run, 0.00031 * (np.arange(11) == 0)),
    "piston_at_speed": lambda run: with_piston(run, 0.5),
    "jammed_bed": on_a_grain,
    "blocked_inlet": lambda run: with_piston(run, 0.03),
    "restitution_lowest": flipping,
    "restitution_half": flipping,
    "restitution_one": flipping,
    "reynolds_all": stopped,
    "overlapping_start": pushed,
    "on_wall_and_edge": flipping,
    "on_section": lambda run: shifted(run, 1e-3),
    "one_particle": lambda run: flipping(run, axis=2),
    "no_particle": lambda run: with_piston(run, 0.1, back=0.0),
    "gradient_thousandfold": lambda run: on_a_grain(run, x_m=1e-3),
    "gradient_negative": lambda run: on_a_grain(run, x_m=-1e-3),
    "gradient_changes_sign": forth_and_back,
    "friction_ten": in_one_place,
    "fluid_reverses": lambda run: with_piston(run, 0.1),
    "no_wide_pores": lambda run: on_a_grain(run, x_m=-1e-4),
    "restart_in_contact": lambda run: starting_with(run, 0.02, 0.01, 0.0),
    "ten_million_steps": flying,
}


def test_every_case_that_holds_is_asked():
    sound = {case.name for case in CASES if case.expected == "holds"}
    assert set(HAPPENINGS) == sound
    assert set(HAPPENS) == sound


@pytest.mark.parametrize("name", HAPPENINGS)
def test_where_nothing_happens_it_is_missed(name: str):
    sentence = what_is_missing(name, still(name))
    assert sentence.endswith(" wanted"), sentence


@pytest.mark.parametrize("name", HAPPENINGS)
def test_what_happens_is_seen(name: str):
    assert what_is_missing(name, HAPPENS[name](still(name))) == ""


def test_of_what_need_not_hold_nothing_is_asked():
    assert what_is_missing("centre_on_wall", still("one_particle")) == ""


def test_a_piston_that_hardly_goes_back_is_missed():
    tame = with_piston(still("blocked_inlet"), 0.005)
    told = "retreat of the piston over the radius: 0.02, at least 0.05 wanted"
    assert what_is_missing("blocked_inlet", tame) == told
    once = tame.series["piston_x_m"].to_numpy().copy()
    once[20:] = once[20]
    again = replace(tame, series=tame.series.assign(piston_x_m=100.0 * once))
    told = "retreats of the piston by half a radius: 1, at least 2 wanted"
    assert what_is_missing("piston_at_speed", again) == told


def test_each_border_of_the_drag_law_is_asked_for():
    run = stopped(still("reynolds_all"))
    velocities = run.velocities_m_s.copy()
    velocities[-1] = velocities[0] / 2.0
    told = "spheres that cross Re = 400: 0, at least 1 wanted"
    assert what_is_missing("reynolds_all", replace(run, velocities_m_s=velocities)) == told


def test_what_enters_where_nothing_may_is_told():
    told = "particles that entered: 20, at most 0 wanted"
    assert what_is_missing("no_wide_pores", on_a_grain(still("no_wide_pores"), x_m=1e-3)) == told


def test_a_sphere_off_a_wall_by_a_micrometre_is_not_on_it():
    run = flipping(still("on_wall_and_edge"))
    off = replace(run, positions_m=run.positions_m + np.array([0.0, 0.0, 1e-6]))
    assert what_is_missing("on_wall_and_edge", off).startswith("spheres exactly at a corner: 0")


def test_what_is_no_number_did_not_happen():
    assert not Wanted("retreat", np.nan, 0.1).there
    assert not Wanted("particles", np.nan, most=0.0).there


def test_retreats_are_told_one_by_one():
    assert retreats_m(np.array([0.0, 2.0, 2.0, 1.0, 0.5, 1.0, 0.0])).tolist() == [1.5, 1.0]
    assert retreats_m(np.zeros(3)).tolist() == []
