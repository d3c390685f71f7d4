"""A case as the engine's input: the deck, and the files it reads."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from liggghts_driver import __version__
from liggghts_driver.deck.particles import particle_data, simulation_box
from liggghts_driver.deck.render import render
from liggghts_driver.effects import decide_effects
from liggghts_driver.effects.base import Column
from liggghts_driver.effects.drag import uses_coupling
from liggghts_driver.effects.piston import NO_TIME_S, piston_stl
from liggghts_driver.flowing import flowing_threshold_m_s
from liggghts_driver.physics.spheres import INERTIA
from liggghts_driver.scene.elastic import bodies_of, elastic

if TYPE_CHECKING:
    from collections.abc import Sequence

    from liggghts_driver.case import Case
    from liggghts_driver.effects import Decision, Effect

#: Young's moduli that the engine takes without being told that they are meant [Pa].
_USUAL_MODULI_PA = (5e6, 1e9)
_CONTACT_PARTS = ("model", "tangential", "cohesion", "rolling_friction")
FRAME_COLUMNS = ("id", "x", "y", "z", "vx", "vy", "vz")
#: Red, green and blue of each material in the snapshots; safe for the colour-blind.
_COLOURS = {
    "particles": "0.0 0.45 0.70",
    "grains": "0.80 0.74 0.64",
    "walls": "0.5 0.5 0.5",
}
PIXELS = 1600
#: A piece is asked for a checkpoint only at its end, and is not to last longer than some seconds.
_PIECE_PARTICLE_STEPS = 20_000_000
_SMALLEST_PART = 20
DATA_FILE = "particles.data"
SERIES_FILE = "series.txt"
PIECES_FILE = "pieces.in"
CHECKPOINT_FILE = "checkpoint.in"
CONTROL_FILE = "control.in"
NOTHING_ASKED = f"# Nothing is asked for: on with the next piece.\njump {PIECES_FILE}\n"


@dataclass(frozen=True)
class Deck:
    """What the engine reads: file names to texts, ``deck.in`` among them.

    ``sentinel`` is the line that the engine prints last; ``mark`` begins the one that it prints
    after a checkpoint.
    """

    files: dict[str, str]
    sentinel: str
    mark: str


def build_deck(
    case: Case, scene_hash: str, ranks: int = 1, decisions: Sequence[Decision] | None = None
) -> Deck:
    """Write the deck of a case, from the start or from its checkpoint.

    ``decisions`` takes the place of what the effects decide by themselves, so that a test can have
    one in the deck whose coefficient is zero.

    Raises
    ------
    DeckError
        If a template and its values do not fit.
    SceneError
        If the engine's own rules cannot be kept.
    """
    decided = decide_effects(case.scene) if decisions is None else decisions
    active = tuple(decision.effect for decision in decided if decision.active)
    sentinel = f"liggghts-driver: complete {scene_hash[:12]}"
    mark = f"liggghts-driver: checkpoint {scene_hash[:12]}"
    values = {
        "version": __version__,
        "scene_hash": scene_hash[:12],
        "sentinel": sentinel,
        "mark": mark,
        **_domain(case, active, ranks),
        **_time(case),
        **_counting(case),
        **_output(case),
        "overlays": [o for effect in active if (o := effect.overlay(case)) is not None],
        "columns": _columns(case, active),
        "refresh": _refresh(case, active),
        "pieces": _pieces(case),
        "piston": case.scene.piston is not None,
        "resume": _resume(case),
        # Names of their own at each: the engine mixes up what has the same name in a restart file.
        "checkpoint": case.checkpoint.number + 1 if case.checkpoint else 1,
        **_kicks(case),
        "coupling": uses_coupling(case),
        "effects": [decision for decision in decided if decision.active],
        "rotation": any(effect.name == "rotation" for effect in active),
        "active": [_fragment(case, effect) for effect in active],
    }
    names = ("deck.in", PIECES_FILE, CHECKPOINT_FILE)
    files = {name: render(f"{name}.j2", values) for name in names}
    if case.edit is not None:
        files["deck.in"] = case.edit(files["deck.in"])
    files[CONTROL_FILE] = NOTHING_ASKED
    if case.checkpoint is None:
        files[DATA_FILE] = particle_data(case)
    if case.scene.piston is not None:
        files["piston.stl"] = piston_stl(case)
    return Deck(files, sentinel, mark)


def _domain(case: Case, active: tuple[Effect, ...], ranks: int) -> dict[str, object]:
    moduli = [elastic(case.scene, body)[0] for body in bodies_of(case.scene)]
    return {
        "title": case.scene.title or "A scene without a title",
        "ranks": ranks,
        "processors": processor_grid(case, ranks),
        "soft": min(moduli) < _USUAL_MODULI_PA[0],
        "hard": max(moduli) > _USUAL_MODULI_PA[1],
        "data_file": DATA_FILE,
        "type_of": {
            name: case.type_of(name) if name in case.materials else 0
            for name in ("particles", "grains", "walls")
        },
        "type_names": ", ".join(f"{n} {name}" for n, name in enumerate(case.materials, start=1)),
        "contact_words": _contact_words(active),
        "skin": case.skin_m,
    }


def _contact_words(active: tuple[Effect, ...]) -> str:
    """The contact model, its parts in the only order in which the engine reads them."""
    chosen = {"tangential": "off"}
    chosen |= {
        effect.contact_words[0]: effect.contact_words[1]
        for effect in active
        if effect.contact_words
    }
    return " ".join(f"{part} {chosen[part]}" for part in _CONTACT_PARTS if part in chosen)


def processor_grid(case: Case, ranks: int) -> str:
    """Cut the domain across y and z, never along the flow: particles pile up at the inlet."""
    if case.scene.specimen is None:
        return "* * *"
    across = max(n for n in range(1, math.isqrt(ranks) + 1) if ranks % n == 0)
    return f"1 {ranks // across} {across}"


def _time(case: Case) -> dict[str, object]:
    plan = case.time
    return {
        "step": plan.step_s,
        "steps": plan.steps,
        "bound": plan.bounds[0],
        "sample_every": plan.sample_every,
        "frame_every": plan.frame_every,
        "image_every": plan.image_every,
    }


def _pieces(case: Case) -> dict[str, object]:
    """The pieces of a run: between two refreshes, or parts of what is between two samples."""
    plan = case.time
    steps = plan.refresh_every if plan.keeps_drag else _shorter(case)
    done = case.checkpoint.step if case.checkpoint else 0
    return {
        "steps": steps,
        "count": (plan.steps - done) // steps,
        "file": PIECES_FILE,
        "control": CONTROL_FILE,
    }


def _shorter(case: Case) -> int:
    """The largest part of a sample interval, in steps, that does not take too long.

    The whole of it where it has only parts so small that their own cost would show.
    """
    interval = case.time.sample_every
    most = max(1, _PIECE_PARTICLE_STEPS // max(1, len(case.population.radii_m)))
    longest = min(interval, most)
    part = next(steps for steps in range(longest, 0, -1) if interval % steps == 0)
    return part if _SMALLEST_PART * part >= longest else interval


def _kicks(case: Case) -> dict[str, object]:
    """Half a step, in which a force over m kicks a velocity, and a torque over m r^2 a spin."""
    half = 0.5 * case.time.step_s
    return {
        "half_step": half,
        "half_spin": half / INERTIA,
        "restart_pattern": "restart/step.*.restart",
    }


def _resume(case: Case) -> dict[str, object] | None:
    """Where the run is taken up; None at the start."""
    then = case.checkpoint
    if then is None:
        return None
    return {
        "number": then.number,
        "step": then.step,
        "restart": then.restart,
        "no_time": NO_TIME_S,
    }


def _counting(case: Case) -> dict[str, object]:
    specimen = case.scene.specimen
    sections = [{"name": name, "x": x} for name, x in case.layout.sections.items()]
    if specimen is None:
        return {"sections": sections}
    return {
        "sections": sections,
        "sphere": 4.0 / 3.0 * math.pi,
        "specimen": {
            "low": 0.0,
            "high": specimen.length,
            "flowing_above": flowing_threshold_m_s(case.scene),
        },
    }


def _columns(case: Case, active: tuple[Effect, ...]) -> list[Column]:
    columns = [
        Column("step", "step"),
        Column("kinetic_energy_j", "c_kinetic"),
        Column("largest_speed_m_s", "c_fastest"),
    ]
    if case.scene.specimen is not None:
        names = ["inside", "flowing", "flow_velocity_sum_m_s"]
        names += [f"volume_past_{name}_m3" for name in case.layout.sections]
        columns += [Column(name, f"c_specimen[{n}]") for n, name in enumerate(names, start=1)]
    return columns + [column for effect in active for column in effect.columns(case)]


def _refresh(case: Case, active: tuple[Effect, ...]) -> dict[str, object] | None:
    """What is set before the run, and what is renewed in it; at most one effect asks for it."""
    wanted = [refresh for effect in active if (refresh := effect.refresh(case)) is not None]
    if not wanted:
        return None
    (refresh,) = wanted
    return {
        "every": refresh.every,
        "first": refresh.once + refresh.again,
        "again": refresh.again,
    }


def _output(case: Case) -> dict[str, object]:
    return {
        "series_file": SERIES_FILE,
        "frame_pattern": "dumps/particles.*.bin",
        "last_frame": f"dumps/particles.{case.time.steps:010d}.bin",
        "last_is_extra": case.time.steps % case.time.frame_every != 0,
        "frame_columns": " ".join(FRAME_COLUMNS),
        "images": case.scene.output.images > 0,
        "image_pattern": "dumps/snapshot.*.ppm",
        "image_options": _camera(case),
        "image_colours": _image_colours(case),
        "paraview": case.scene.output.paraview,
        "paraview_pattern": "dumps/paraview.*.vtk",
    }


def _camera(case: Case) -> str:
    """A view along y, without perspective, in which the box just fills the picture."""
    x, y, z = (high - low for low, high in simulation_box(case))
    longer = max(x, z)
    width, height = (max(1, round(PIXELS * side / longer)) for side in (x, z))
    # The engine scales the longest edge of the box to half of the picture's height.
    zoom = 2.0 * max(x, y, z) * width / (height * x)
    return f"size {width} {height} view 90 270 zoom {zoom!r} box no 0.0 shiny 0.1"


def _image_colours(case: Case) -> str:
    """Colours; the front half of a specimen is cut away, so that the flow inside is seen."""
    defined = " ".join(f"color {name} {rgb}" for name, rgb in _COLOURS.items())
    used = " ".join(f"acolor {case.type_of(name)} {name}" for name in case.materials)
    cut = " thresh y >= 0.0" if case.scene.specimen is not None else ""
    return f"{defined} {used} backcolor white{cut}"


def _fragment(case: Case, effect: Effect) -> dict[str, object]:
    return {
        "slot": effect.slot,
        "fragment": effect.fragment(case),
        "numbers": effect.values(case),
    }
