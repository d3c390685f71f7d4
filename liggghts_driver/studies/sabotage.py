"""How a case is broken on purpose: the ways, and why some of them break nothing."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

from liggghts_driver.drag_plan import drag_relaxation_s

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from liggghts_driver.case import Case

    Replacement = str | Callable[[re.Match[str]], str]

#: The step is this many times too large.
STEPS = 20
LONGER_STEP = f"step x {STEPS}"
#: So weak a servo makes the piston three times as heavy.
_WEAK = 0.3
NO_DRAG, NO_PRESSURE, WEAK_SERVO = "no drag", "no pressure", f"servo x {_WEAK}"
NO_PISTON = "no piston"
#: The engine takes no servo without contacts. It looks for those of the mesh's group and of that of
#: the wall made of it: both must be of nobody.
_OF_ALL = r"^(fix +piston) all (mesh/.*\n)(fix +piston_contact) all "
_OF_NOBODY = r"group           nobody subtract all all\n\1 nobody \2\3 nobody "
#: The engine's implicit drag: as it is right, and with the argument that is right by its name.
_IMPLICIT, HALF = "CrankNicolson 1.0", "CrankNicolson 0.5"
#: With 0.5 the engine's step is 1 - x / (1 + x / 4), x = K dt / m, which makes the drag stronger by
#: the share x / 4: so little that no answer changes by 5 % below this x.
_SMALL_DRAG_NUMBER = 0.1


@dataclass(frozen=True)
class Sabotage:
    """One way to break a case behind the driver's back.

    Attributes
    ----------
    name
        What is broken.
    alter
        Makes the broken case of a checked one, as for ``solve``.
    harmless
        Why it breaks nothing in this case, though it makes a difference; empty where it should.
    at_most
        How large that difference may be, in radii of the smallest sphere.
    """

    name: str
    alter: Callable[[Case], Case]
    harmless: str = ""
    at_most: float = math.inf


#: In which cases so large a step breaks nothing: why, and how far bodies then are from where they
#: are with the right one, at most, in radii of the smallest sphere.
_STEP_HARMLESS: Mapping[str, tuple[str, float]] = {
    "reynolds_all": ("nothing touches, and the implicit drag is stable with any step", 20.0),
    "on_section": ("nothing touches, and particles relax in many steps all the same", 1e-3),
}


def sabotages_of(name: str, case: Case) -> list[Sabotage]:
    """Every way in which a case can be broken.

    The step; each wall left out, the piston's among them; the drag or the pressure left out; a
    servo too weak for the piston; and the argument of the engine's implicit drag.

    Parameters
    ----------
    name
        Of the hard case.
    case
        As it is run.
    """
    reason, at_most = _STEP_HARMLESS.get(name, ("", math.inf))
    found = [Sabotage(LONGER_STEP, with_longer_step, reason, at_most)]
    for face in case.layout.walls:
        fix = f"wall_{face[0]}_{'low' if face[1] == '-' else 'high'}"
        found.append(Sabotage(f"no wall {face}", _left_out(fix)))
    return [*found, *_of_piston(case), *_of_forces(case)]


def _of_piston(case: Case) -> Iterator[Sabotage]:
    if case.scene.piston is None:
        return
    yield Sabotage(NO_PISTON, partial(_edited, _OF_ALL, _OF_NOBODY))
    yield Sabotage(WEAK_SERVO, _multiplied(r"^fix +piston all .* ki ", _WEAK))


def _of_forces(case: Case) -> Iterator[Sabotage]:
    if case.scene.dragging_fluid is not None:
        yield Sabotage(NO_DRAG, _multiplied(r'^variable +(?:drag|stokes) +atom "', 0.0))
    if case.scene.pressure is not None:
        yield Sabotage(NO_PRESSURE, _multiplied(r'^variable +pressure +atom "(?:v_swing\*)?', 0.0))
    if case.time.drag_scheme == "implicit":
        edited = partial(_edited, re.escape(_IMPLICIT), HALF)
        yield Sabotage(HALF, edited, _small_drag(case))


def with_longer_step(case: Case) -> Case:
    """The same time in fewer steps, samples and frames about as often where that is possible."""
    plan = case.time
    refresh = _multiple(plan.refresh_every, 1)
    sample = _multiple(plan.sample_every, refresh)
    longer = replace(
        plan,
        step_s=STEPS * plan.step_s,
        steps=_multiple(plan.steps, sample),
        sample_every=sample,
        refresh_every=refresh,
        frame_every=_multiple(plan.frame_every, sample),
        image_every=_multiple(plan.image_every, sample),
    )
    return replace(case, time=longer)


def _multiple(steps: int, unit: int) -> int:
    """About as long a time in longer steps: whole units of them, and one at least."""
    return unit * max(1, round(steps / (STEPS * unit)))


def _left_out(fix: str) -> Callable[[Case], Case]:
    return partial(_edited, rf"^fix +{fix} .*\n", "")


def _multiplied(before: str, factor: float) -> Callable[[Case], Case]:
    """Another number in the deck, after what a pattern matches."""
    return partial(_edited, rf"({before})([-+.\de]+)", lambda m: f"{m[1]}{factor * float(m[2])!r}")


def _edited(pattern: str, by: Replacement, case: Case) -> Case:
    return replace(case, edit=partial(_replaced, pattern, by))


def _replaced(pattern: str, by: Replacement, deck: str) -> str:
    changed, times = re.subn(pattern, by, deck, flags=re.MULTILINE)
    assert times == 1, f"{times} times {pattern} in the deck"
    return changed


def _small_drag(case: Case) -> str:
    """Why the drag is hardly changed by the wrong argument; empty where it is."""
    if not case.population.particles:
        return ""
    relaxation = drag_relaxation_s(case.scene, case.population, case.speed_bound_m_s)
    number = case.time.step_s / relaxation
    if number > _SMALL_DRAG_NUMBER:
        return ""
    return f"K dt / m is at most {number:.1g}: the drag is too strong by a quarter of that"
