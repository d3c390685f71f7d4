"""What the fluid forces cost beside the contacts alone: each scheme, and a deck written by hand.

Every variant runs the same spheres for the same number of steps, from the dilute start of the
full case or from its dense state. A run of no steps is subtracted, which leaves the stepping.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from liggghts_driver.case import Case, make_case
from liggghts_driver.deck.build import build_deck
from liggghts_driver.engine.find import find_engine
from liggghts_driver.results.positions import iter_instants
from liggghts_driver.results.series import read_run_series
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.scene import make_scene, read_scene
from liggghts_driver.written import write_deck
from tests.bench.timing import wall_seconds

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from liggghts_driver.population import Population

#: Effects beside the contacts: what each one sets in the scene.
EFFECTS: dict[str, dict[str, dict[str, Any]]] = {
    "friction": {"contact": {"friction": 0.3}},
    "friction and rolling": {"contact": {"friction": 0.3, "rolling_friction": 0.05}},
    "cohesion": {"contact": {"cohesion_energy_density": 1.0}},
    "near field": {"near_field": {"force": 1e-7, "reach": 5e-4}},
    "gravity": {"gravity": {"acceleration": (0.0, 0.0, -1e-3)}},
}
#: Each variant's keys of [drag]; None: the fluid is left out of the scene.
VARIANTS: dict[str, dict[str, str] | None] = {
    "contacts only": None,
    "held": {"scheme": "held"},
    "implicit": {"scheme": "implicit"},
    "held, by addforce": {"scheme": "held", "carrier": "addforce"},
    "exact": {"scheme": "exact"},
    "written by hand": None,
    **dict.fromkeys(EFFECTS),
}


@dataclass(frozen=True)
class Start:
    """A state to start from: the spheres, and where the piston is."""

    name: str
    population: Population
    piston_x_m: float


def dilute_start(scene_file: Path) -> tuple[Case, Start]:
    """The full case as it begins."""
    case = make_case(read_scene(scene_file))
    return case, Start("dilute start", case.population, case.layout.low[0])


def later_start(case: Case, run: RunDirectory, time_s: float) -> Start:
    """The full case as a run of it had it at some time, velocities included."""
    wanted = time_s / case.time.step_s
    instant = min(iter_instants(run), key=lambda frame: abs(frame.step - wanted))
    series = read_run_series(run)
    x = float(np.interp(instant.step, series["step"], series["piston_x_m"]))
    population = case.population
    centres, velocities = population.centres_m.copy(), population.velocities_m_s.copy()
    centres[: population.particles] = instant.positions_m
    velocities[: population.particles] = instant.velocities_m_s
    moved = replace(population, centres_m=centres, velocities_m_s=velocities)
    return Start(f"state at {instant.step * case.time.step_s:.0f} s", moved, x)


def stepping_task(
    case: Case,
    start: Start,
    scheme: str,
    steps: int,
    folder: Path,
    ranks: int = 1,
    edit: Callable[[str], str] = str,
) -> Callable[[], float]:
    """A measurement: seconds that ``steps`` steps take, the engine's start-up subtracted.

    ``edit`` changes the deck's text, for settings that a scene does not offer.
    """
    full = _written(case, start, scheme, steps, folder / f"{scheme} {steps}", ranks)
    empty = _written(case, start, scheme, 0, folder / f"{scheme} 0", ranks)
    for deck in (full / "deck.in", empty / "deck.in"):
        deck.write_text(edit(deck.read_text(encoding="utf-8")), encoding="utf-8")
    command = find_engine().command(ranks)
    return lambda: wall_seconds(command, full) - wall_seconds(command, empty)


def _written(case: Case, start: Start, scheme: str, steps: int, folder: Path, ranks: int) -> Path:
    variant = _variant(case, start, scheme, steps)
    deck = build_deck(variant, "0" * 64, ranks)
    text = deck.files["deck.in"]
    if steps == 0:
        deck.files["pieces.in"] = 'print "nothing to do"\n'
    if scheme == "written by hand":
        text = text.replace("# ---- 6.", f"{by_hand(variant)}\n# ---- 6.")
    deck.files["deck.in"] = text
    write_deck(variant, deck, RunDirectory(folder))
    return folder


def _variant(case: Case, start: Start, scheme: str, steps: int) -> Case:
    """The case with one way of computing the fluid forces, no output but the series."""
    data: dict[str, Any] = case.scene.model_dump(mode="json", exclude_none=True)
    data["output"] |= {"samples": 10, "frames": 1, "images": 0}
    drag = VARIANTS[scheme]
    if drag is None:
        del data["fluid"], data["pressure"]
        data["piston"]["mass"] = case.piston_mass_kg
    else:
        data["drag"] |= drag
    for table, keys in EFFECTS.get(scheme, {}).items():
        data[table] = data.get(table, {}) | keys
    scene = make_scene(data)
    # Whole refreshes, so that every scheme ends on one.
    count = case.time.refresh_every * max(1, math.ceil(steps / case.time.refresh_every))
    plan = replace(
        case.time,
        steps=count,
        sample_every=count,
        frame_every=count,
        image_every=count,
        drag_scheme="" if drag is None else drag["scheme"],
    )
    low = (start.piston_x_m, *case.layout.low[1:])
    return replace(
        case,
        scene=scene,
        population=start.population,
        layout=replace(case.layout, low=low),
        time=plan,
    )


def by_hand(case: Case) -> str:
    """The drag and pressure forces as one writes them from the paper, Eq. by Eq."""
    mu, rho, gradient = 0.001, 2000.0, 10.0
    fluid = f"{case.scene.piston.acceleration if case.scene.piston else 0.0}*v_time"
    return f"""
# Eq. 19, Eq. 18, Eq. 17 and Eq. 20, as they stand in the paper
variable ux atom "vx-{fluid}*(x<0)"
variable slip atom "sqrt(v_ux*v_ux+vy*vy+vz*vz)+0.000000000001"
variable Re atom "2*{rho}*r*v_slip/{mu}"
variable Cd atom "(v_Re<=1)*24/v_Re+(v_Re>1)*(v_Re<=400)*24*v_Re^(-0.646)\
+(v_Re>400)*(v_Re<=3e5)*0.5+(v_Re>3e5)*(v_Re<=2e6)*0.000366*v_Re^0.4275+(v_Re>2e6)*0.18"
variable area atom "{math.pi!r}*r*r"
variable fx atom "-0.5*{rho}*v_Cd*v_area*v_slip*v_ux+2*r*{gradient}*v_area*(x>0)"
variable fy atom "-0.5*{rho}*v_Cd*v_area*v_slip*vy"
variable fz atom "-0.5*{rho}*v_Cd*v_area*v_slip*vz"
fix byhand particles addforce v_fx v_fy v_fz
"""
