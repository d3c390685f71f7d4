"""The study of exact problems on the engine, in a reduced form: every order is as expected."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest

from liggghts_driver.engine.stop import Stop
from liggghts_driver.studies.exact import Measured, measure, tasks_of
from liggghts_driver.studies.exact_problems import exact_problems
from liggghts_driver.sweeps.local import cores_here, run_local

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.engine

#: Runs side by side share the engine's wait for MPI at its start; no time is measured here.
_SIDE_BY_SIDE = 8


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Measured]:
    """Every second value of each knob, the finest among them, with few spheres."""
    runs: Path = tmp_path_factory.mktemp("exact")
    problems = exact_problems(pairs=24, spheres=10, every=2)
    cores = [cores_here()[n % len(cores_here())] for n in range(_SIDE_BY_SIDE)]
    outcomes = run_local(tasks_of(problems, runs), Stop(), cores=cores)
    assert [name for name, outcome in outcomes.items() if outcome.ending != "done"] == []
    return {f"{each.problem.name}: {each.title}": each for each in measure(problems, runs)}


def test_every_order_is_as_expected(measured: dict[str, Measured]) -> None:
    # Each tolerance, and its reason, stands beside the expectation.
    assert {name: each.order for name, each in measured.items() if not each.is_right} == {}
    assert len(measured) == 25


def test_errors_are_as_large_as_theory_says(measured: dict[str, Measured]) -> None:
    """Where a leading term is known in closed form, not its order alone."""
    free = measured["piston: free, place"]
    # x = a t (t - dt) / 2: dt / t is missing, to rounding.
    assert free.errors == pytest.approx(free.knob_values, rel=1e-6)
    # (1 - k) / (1 + k) for exp(-2k), k = dt / 2 tau, is wrong by (2/3) k^3 in each of t / dt steps:
    # (t / tau) exp(-t / tau) (dt / tau)^2 / 12, at most 1 / 12e of the square, for the quickest.
    pushed = measured["stokes: pushed, velocity"]
    bound = [step**2 / 12.0 / math.e for step in pushed.knob_values]
    # Slower ones err less, by the square of their times: radii differ by up to 1.44, tau by its
    # square.
    assert all(error < 1.01 * most for error, most in zip(pushed.errors, bound, strict=True))
    assert all(error > most / 1.44**4 for error, most in zip(pushed.errors, bound, strict=True))
    # A launch misses half of a step's drag, dt / 2 tau of its velocity, which has decayed for a
    # fifth of tau in the first frame. The next term is dt / tau of this.
    launched = measured["stokes: launched, velocity"]
    for step, error in zip(launched.knob_values, launched.errors, strict=True):
        assert error == pytest.approx(0.5 * step * math.exp(-0.2), rel=step)
