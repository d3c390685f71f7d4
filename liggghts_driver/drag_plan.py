"""By which scheme the drag of a scene is integrated, and how long its coefficients are kept."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from liggghts_driver.errors import SceneError
from liggghts_driver.physics.drag import BRANCHES, drag_coefficient_n_s_m, reynolds
from liggghts_driver.physics.oscillation import angular_rate_rad_s
from liggghts_driver.scene.swing import swing_period_s

if TYPE_CHECKING:
    from liggghts_driver.population import Population
    from liggghts_driver.scene.model import Scene

Scheme = Literal["exact", "held", "implicit"]

#: A force kept for a time T is stable below K (1 + p) T / m = 1, p the exponent in K ~ slip^p;
#: p is at most 1.43 (Eq. 18). Beyond this share of m / K nothing is extrapolated over T either; nor
#: of period / 2 pi, the time scale of a pressure gradient that goes to and fro.
LONGEST_KEPT = 0.25
#: The engine adds a held force faster than it steps an implicit drag; computing the force anew
#: costs as much as several steps, so this is so only where the force is kept for some while.
_WORTHWHILE_STEPS = 20


@dataclass(frozen=True)
class DragPlan:
    """The scheme of a scene's drag, and the longest time for which its coefficients are kept."""

    scheme: Scheme
    interval_s: float
    relaxation_s: float


def plan_drag(
    scene: Scene, population: Population, slip_m_s: float, step_s: float
) -> DragPlan | None:
    """Choose scheme and interval for particles that slip at most so fast; None without drag.

    ``step_s`` is the longest step that everything but the drag allows. ``drag.scheme = "auto"``
    takes ``held`` where a force may be kept for many steps, else ``implicit``.

    Raises
    ------
    SceneError
        If ``drag.refresh`` is so long that held forces would grow without bound, or that what is
        kept would not follow a pressure gradient that goes to and fro.
    """
    if scene.dragging_fluid is None:
        return None
    if not population.particles:
        return DragPlan(_scheme(scene, 0.0, math.inf, step_s), _samples_s(scene), math.inf)
    relaxation = drag_relaxation_s(scene, population, slip_m_s)
    held = _interval_s(scene, population, slip_m_s, relaxation, "held")
    scheme = _scheme(scene, held, relaxation, step_s)
    _check_followed(scene, scheme)
    if scheme == "held":
        _check_stable(scene, held, relaxation)
        return DragPlan("held", held, relaxation)
    interval = _interval_s(scene, population, slip_m_s, relaxation, scheme)
    return DragPlan(scheme, interval, relaxation)


def _scheme(scene: Scene, held_s: float, relaxation_s: float, step_s: float) -> Scheme:
    """The scheme asked for; for ``auto``, held where a force may be kept for many steps."""
    drag = scene.drag
    assert drag.scheme != "none"
    if drag.scheme != "auto":
        return drag.scheme
    stable = held_s <= LONGEST_KEPT * relaxation_s
    worthwhile = stable and held_s >= _WORTHWHILE_STEPS * step_s
    return "held" if worthwhile or drag.carrier == "addforce" else "implicit"


def _check_stable(scene: Scene, interval_s: float, relaxation_s: float) -> None:
    longest = LONGEST_KEPT * relaxation_s
    if interval_s > longest:
        raise SceneError(
            f"drag.refresh = {scene.drag.refresh:g} s: must be at most {longest:.4g} s, "
            f"{LONGEST_KEPT} of the time in which a particle relaxes, or held forces may grow "
            "without bound; shorten or remove drag.refresh, or set drag.scheme = implicit and "
            "drag.carrier = coupling"
        )


def _check_followed(scene: Scene, scheme: Scheme) -> None:
    refresh, longest = scene.drag.refresh, LONGEST_KEPT * _swing_s(scene)
    if scheme != "exact" and refresh is not None and refresh > longest:
        raise SceneError(
            f"drag.refresh = {refresh:g} s: must be at most {longest:.4g} s, {LONGEST_KEPT} of "
            "pressure.period / 2 pi, or what is kept does not follow the gradient; shorten or "
            "remove drag.refresh, or set drag.scheme = exact"
        )


def _swing_s(scene: Scene) -> float:
    """Time scale on which a pressure gradient cos(w t) changes, 1 / w; infinite if it does not."""
    period = swing_period_s(scene)
    return math.inf if period is None else 1.0 / angular_rate_rad_s(period)


def drag_relaxation_s(scene: Scene, population: Population, slip_m_s: float) -> float:
    """Shortest m / K of the particles when they slip through the fluid with a speed [s]."""
    assert scene.fluid is not None
    radii = population.particle_radii_m
    coefficient = drag_coefficient_n_s_m(
        scene.fluid.density, scene.fluid.viscosity, radii, slip_m_s
    )
    masses = scene.particles.density * population.particle_volumes_m3
    return float((masses / coefficient).min())


def _interval_s(
    scene: Scene, population: Population, slip_m_s: float, relaxation_s: float, scheme: Scheme
) -> float:
    """Time for which a coefficient may be kept: ``drag.refresh``, or what the physics allows.

    What is kept for a time T is taken at its middle, extrapolated from the last two refreshes,
    which is of second order in T. The first interval has nothing to extrapolate from: it is one
    step of Euler's, and its error, half of (T / tau)^2 with tau = m / K (1 + p) for K ~ slip^p, is
    the largest. At the entrance of a specimen the fluid changes: no particle may cross more than
    its radius in between. The implicit scheme keeps K alone, which is constant below Re = 1.

    Under a pressure gradient cos(w t) velocities go to and fro as well, for ever. To extrapolate
    one costs (3/8) (w T)^2 of it, to take the gradient at the middle (1/24) (w T)^2: together less
    than half of (w T)^2, so that 1 / w counts as tau does.
    """
    assert scene.fluid is not None
    fluid = scene.fluid
    samples = _samples_s(scene)
    if scheme == "exact":
        return samples
    if scene.drag.refresh is not None:
        return min(samples, scene.drag.refresh)
    crossing = math.inf
    if scene.specimen is not None:
        crossing = float(population.particle_radii_m.min()) / slip_m_s
    largest = float(population.particle_radii_m.max())
    power = _steepest(float(reynolds(fluid.density, fluid.viscosity, largest, slip_m_s)))
    if scheme == "implicit" and power == 0.0:
        return min(samples, crossing)
    swing = _swing_s(scene)
    tolerated = math.sqrt(2.0 * scene.drag.tolerance) * min(relaxation_s / (1.0 + power), swing)
    return min(samples, crossing, tolerated, LONGEST_KEPT * min(relaxation_s, swing))


def _samples_s(scene: Scene) -> float:
    return scene.time.duration / scene.output.samples


def _steepest(reynolds_number: float) -> float:
    """The largest exponent p in K ~ slip^p up to a Reynolds number (Eq. 18)."""
    ends = [0.0, *(branch.up_to for branch in BRANCHES)]
    reached = [b.power for b, start in zip(BRANCHES, ends, strict=False) if start < reynolds_number]
    return max(reached, default=0.0)
