"""Statements of the paper held against each other, and against its own equations.

No run enters the numbers: they are what the paper prints, and what its equations make of its data.
Numbers, and the verdict of each pair, come from the shipped scene and from what is printed; what
words explain is the paper's text, which has no numbers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from liggghts_driver.darcy import estimate
from liggghts_driver.paper import law
from liggghts_driver.paper.printed import (
    FIRST_ROW_AS_PRINTED_M3_S,
    GRAINS,
    MAIN_GRADIENT_PA_M,
    PARTICLES,
    PERMEABILITY_M2,
    ROWS,
    STEADY_FROM_S,
    TABLE_1,
)
from liggghts_driver.paper.words import FLOW_UNIT, listed
from liggghts_driver.prediction import darcy_inputs
from liggghts_driver.report.numbers import number
from liggghts_driver.scene.layout import mean_particle_volume_m3

if TYPE_CHECKING:
    from collections.abc import Iterator

    from liggghts_driver.scene.model import Specimen

#: Numbers closer than this are the same, as printed to three digits.
_SAME = 0.01
#: How densely spheres lie that have come to rest at random, about.
_DENSE = 0.6
#: A ratio that changes by more than this from one gradient to another is no constant.
_CONSTANT = 1.25


#: "open": they clash in one reading of the paper and not in another.
Verdict = Literal["clash", "open", "together"]


@dataclass(frozen=True)
class Statement:
    """Two statements: whether they hold together, and why in words."""

    title: str
    words: str
    verdict: Verdict


def statements() -> list[Statement]:
    """What was found of the physics, the weightiest first."""
    return [
        _drag(),
        _velocities(),
        _piston_at_ten(),
        _travel(),
        _piston(),
        _outside(),
        _at_rest(),
        _closed(),
        _grains(),
    ]


def slips() -> list[str]:
    """Printed numbers that are not what the paper's own equations give, a sentence each."""
    return list(_slips())


def _drag() -> Statement:
    gradients = [row.gradient_pa_m for row in TABLE_1]
    first, last = (ROWS[gradient] for gradient in law.slow_gradients())
    printed = math.log(last.entrance_m3_s / first.entrance_m3_s) / math.log(
        last.gradient_pa_m / first.gradient_pa_m
    )
    free = law.free_flight_exponent(first.gradient_pa_m, last.gradient_pa_m)
    slowest, fastest = (law.free_flight_reynolds(g) for g in (gradients[0], gradients[-1]))
    shares = [
        law.flowing_share(row.entrance_m3_s, float(np.mean(row.velocity_m_s)))
        for row in (first, last)
    ]
    words = (
        f"With the drag of Eq. 18 a lone particle has Re = {number(slowest, 2)} at "
        f"{gradients[0]:g} Pa/m and {number(fastest, 2)} at {gradients[-1]:g} Pa/m: "
        f"{'all above 1' if slowest > 1.0 else 'not all above 1'}, where the drag does not go with "
        f"the velocity, and its speed goes with the gradient to the power {number(free, 2)}. The "
        f"simulated flow rates of Table 1 go with its power {number(printed, 3)} from "
        f"{first.gradient_pa_m:g} to {last.gradient_pa_m:g} Pa/m. That is strict only where "
        "particles fill the same share of the pores at each gradient; by Table 1 (flow rate over "
        f"velocity and pores) the share that flows is {number(shares[0], 2)} at "
        f"{first.gradient_pa_m:g} and {number(shares[1], 2)} at {last.gradient_pa_m:g} Pa/m."
    )
    title = "The drag of Eq. 18, and flow rates proportional to the gradient"
    constant = max(shares) / min(shares) < _CONSTANT
    clash: Verdict = "clash" if constant else "open"
    return Statement(title, words, "together" if abs(printed - free) < 0.1 else clash)


def _velocities() -> Statement:
    ratios = {
        row.gradient_pa_m: float(np.mean(row.velocity_m_s)) / law.free_flight_m_s(row.gradient_pa_m)
        for row in TABLE_1
    }
    told = ", ".join(f"{number(ratio, 2)} at {g:g}" for g, ratio in ratios.items())
    rise = ratios[MAIN_GRADIENT_PA_M] / ratios[TABLE_1[0].gradient_pa_m]
    words = (
        f"The printed velocity of the flowing particles over that of free flight is {told} Pa/m: "
        f"up to {MAIN_GRADIENT_PA_M:g} Pa/m it rises by a factor of {number(rise, 2)}. The same "
        "grains stand in the way, which by themselves leave it about the same, and a push from "
        "behind counts most at small gradients and makes it fall, as in our runs. Nothing in Eqs. "
        "17 to 20 makes it rise."
    )
    title = "Table 1's velocities, and Eqs. 17 to 20"
    return Statement(title, words, "clash" if rise > _CONSTANT else "together")


def _travel() -> Statement:
    scene = law.example()
    length, end = law.to_the_middle_m(), scene.time.duration
    times = {
        row.gradient_pa_m: length / max(row.velocity_m_s[1], law.free_flight_m_s(row.gradient_pa_m))
        for row in TABLE_1
    }
    told = ", ".join(f"{number(time, 2)} s at {g:g}" for g, time in times.items())
    assert scene.piston is not None
    entry = law.suspension_speed_m_s(STEADY_FROM_S)
    gain = law.carried_m(entry, MAIN_GRADIENT_PA_M)
    late = [f"{g:g}" for g, time in times.items() if time > end]
    never = ""
    if late:
        never = f" Alone it would not be there at {listed(late)} Pa/m when the runs end."
    words = (
        f"From the entrance to the middle it is {number(1e3 * length, 2)} mm. At the fastest "
        "printed mean velocity, or at that of free flight where this is faster, a particle needs "
        f"{told} Pa/m. The text has the steady state at both sections from about "
        f"{STEADY_FROM_S:g} s on (at {MAIN_GRADIENT_PA_M:g} Pa/m), the runs end at {end:g} s, and "
        f"Table 1 has a flow past the middle at every gradient.{never} Sooner it gets there only "
        "if a dense bed pushes from behind, or if it enters fast: a lone one that enters at "
        f"{number(1e3 * entry, 2)} mm/s, as the suspension does by {STEADY_FROM_S:g} s, "
        f"gains {number(1e3 * gain, 2)} mm on the way at {MAIN_GRADIENT_PA_M:g} Pa/m. When the "
        "first particles of our runs pass the middle is told above, under Figs. 3 and 4."
    )
    title = "A steady flow past the middle, and the velocities without another push"
    together = not late and times[MAIN_GRADIENT_PA_M] <= STEADY_FROM_S
    return Statement(title, words, "together" if together else "open")


def _piston() -> Statement:
    push = law.piston_force_n()
    first, last = TABLE_1[0].gradient_pa_m, TABLE_1[-1].gradient_pa_m
    forces = {g: PARTICLES * law.pressure_force_on_one_n(g) for g in (first, last)}
    words = (
        f"A piston that weighs as much as the suspension before it, {number(law.piston_mass_kg())} "
        f"kg, is pushed with {number(1e3 * push, 2)} mN at every gradient. The pressure gradient "
        f"pushes all {number(PARTICLES)} particles together with {number(1e3 * forces[first], 2)} "
        f"mN at {first:g} Pa/m and {number(1e3 * forces[last], 2)} mN at {last:g} Pa/m, and those "
        "inside the specimen with less. What such a piston drives cannot go with a gradient that "
        "it does not feel. A piston whose force goes with the gradient (*piston follows*) has no "
        "such clash, and one that weighs so little that its force is that of the smallest gradient "
        "hardly has it."
    )
    title = "One piston for all gradients, and flow rates proportional to the gradient"
    return Statement(title, words, "together" if push < forces[first] else "open")


def _piston_at_ten() -> Statement:
    scene, printed = law.example(), ROWS[MAIN_GRADIENT_PA_M].entrance_m3_s
    assert scene.piston is not None
    assert scene.specimen is not None
    assert scene.particles.volume_fraction is not None
    area_m2 = scene.specimen.width**2
    solid_m = PARTICLES * mean_particle_volume_m3(scene.particles) / area_m2
    length_m, bed_m = solid_m / scene.particles.volume_fraction, solid_m / _DENSE
    acceleration = scene.piston.acceleration
    way_m, speed = 0.5 * acceleration * STEADY_FROM_S**2, law.suspension_speed_m_s(STEADY_FROM_S)
    brought = speed * area_m2 * scene.particles.volume_fraction
    meets_s = math.sqrt(2.0 * (length_m - bed_m) / acceleration)
    words = (
        f"With {1e3 * acceleration:g} mm/s² the piston has gone {number(1e3 * way_m)} of "
        f"{number(1e3 * length_m)} mm at {STEADY_FROM_S:g} s, and goes at "
        f"{number(1e3 * acceleration * STEADY_FROM_S, 2)} mm/s, if nothing holds it yet. Particles "
        f"lag behind the fluid, at {number(1e3 * speed, 2)} mm/s, and bring "
        f"{number(brought / FLOW_UNIT, 2)} × 10⁻⁶ m³/s to the entrance, "
        f"{number(brought / printed, 2)} times what Table 1 has past it. The others pile up there. "
        f"Even if none entered, in a bed of {_DENSE:g}, the piston would meet it only at "
        f"{number(meets_s, 2)} s, with {number(1e3 * acceleration * meets_s, 2)} mm/s: a flow that "
        "is steady before would have to stay so through that impact. With a reservoir that is much "
        "shorter it has met that bed before."
    )
    together = meets_s <= STEADY_FROM_S or brought <= printed
    title = f"A piston that starts from rest, and a steady flow from {STEADY_FROM_S:g} s on"
    return Statement(title, words, "together" if together else "open")


def _outside() -> Statement:
    scene = law.example()
    assert scene.piston is not None
    flux = float(np.asarray(law.law(MAIN_GRADIENT_PA_M).darcy_flux_m_s))
    overtaken = flux / scene.piston.acceleration
    end = scene.piston.acceleration * scene.time.duration / flux
    middle_s = 0.5 * scene.time.duration
    ratio = law.drag_over_pressure_force(middle_s, MAIN_GRADIENT_PA_M)
    words = (
        f"The fluid before the specimen goes with a t: at {MAIN_GRADIENT_PA_M:g} Pa/m with "
        f"{number(end, 2)} times the Darcy flux at {scene.time.duration:g} s, and "
        f"with more than it from {number(overtaken, 2)} s on. An incompressible fluid has one flux "
        "everywhere; inside the specimen it is at rest in the simulation (v_f = 0), and q in the "
        f"law. By Eq. 18 its drag on a particle that waits before the specimen is "
        f"{number(ratio, 2)} times the force of that gradient on one inside, at {middle_s:g} s: "
        "not the gradient but this drag presses the particles in. (*With the piston* has the same "
        "jump at the entrance for as long as the piston moves fast; it only ends sooner.)"
    )
    title = "v_f = a t outside, v_f = 0 inside, and an incompressible fluid"
    return Statement(title, words, "together" if overtaken >= scene.time.duration else "clash")


def _at_rest() -> Statement:
    found = law.law(MAIN_GRADIENT_PA_M)
    velocity = float(np.asarray(found.pore_velocity_m_s))
    words = (
        "Inside the specimen the simulation has a pressure gradient, and a fluid at rest (v_f = "
        "0). By Darcy's law (Eqs. 12 to 15), and without body forces, a viscous fluid at rest has "
        f"no gradient of pressure, and at {MAIN_GRADIENT_PA_M:g} Pa/m the law's fluid goes through "
        f"the pores at {number(1e3 * velocity)} mm/s. In such a fluid a lone particle would go "
        f"faster by as much as its free flight, {number(1e3 * _free_flight())} mm/s. That both are "
        "nearly the same at this gradient is chance: one goes with the permeability, the other "
        "with the size of a particle."
    )
    title = "A pressure gradient, and v_f = 0 inside"
    return Statement(title, words, "clash" if velocity > 0.0 else "together")


def _free_flight() -> float:
    return law.free_flight_m_s(MAIN_GRADIENT_PA_M)


def _closed() -> Statement:
    words = (
        "The specimen is enclosed by walls but for its entrance. If these are tight for the fluid, "
        "none leaves it, while the law is that of a fluid that passes through with the flux q and "
        "carries the particles. If they hold back the particles alone, as in a simulation of "
        "particles they do, there is no clash: the paper does not say."
    )
    return Statement("A closed specimen, and Darcy's law", words, "open")


def _grains() -> Statement:
    scene = law.example()
    assert scene.specimen is not None
    assert scene.grains is not None
    filled = GRAINS * mean_particle_volume_m3(scene.grains) / _volume_m3(scene.specimen)
    words = (
        f"{GRAINS} whole grains of the given radii fill {number(filled, 2)} of the cube, not "
        f"{scene.specimen.solid_fraction:g}. A packing of that fraction, cut by the cube with all "
        "grains kept that touch it, has about as many: that is the specimen here, and with it the "
        "numbers hold together."
    )
    title = f"{GRAINS} grains, and a solid fraction of {scene.specimen.solid_fraction:g}"
    same = abs(filled / scene.specimen.solid_fraction - 1.0) < 0.05
    return Statement(title, words, "together" if same else "open")


def _volume_m3(specimen: Specimen) -> float:
    return specimen.length * specimen.width**2


def _slips() -> Iterator[str]:
    main = ROWS[MAIN_GRADIENT_PA_M]
    found = estimate(darcy_inputs(law.example()), main.gradient_pa_m)
    own = found.effective_permeability_m2
    if abs(PERMEABILITY_M2 / own - 1.0) > _SAME:
        over = 100.0 * (PERMEABILITY_M2 / own - 1.0)
        flow = float(np.asarray(found.particle_flow_rate_m3_s))
        yield (
            f"P* is printed as {number(PERMEABILITY_M2)} m², Eqs. 10 and 11 give {number(own)} m²: "
            f"the printed one is {number(over, 2)} % higher. With it Q at {main.gradient_pa_m:g} "
            f"Pa/m is {number(main.law_m3_s)} m³/s, as printed; from the equations it is "
            f"{number(flow)} m³/s. Nothing is tuned to hide this."
        )
    first, printed = TABLE_1[0], FIRST_ROW_AS_PRINTED_M3_S
    if abs(printed[0] / first.law_m3_s - 1.0) > 1.0:
        yield (
            f"Table 1 prints {number(printed[0])} and {number(printed[1])} m³/s for the simulation "
            f"at {first.gradient_pa_m:g} Pa/m (entrance and middle), "
            f"{number(printed[0] / first.law_m3_s, 2)} times the law's {number(first.law_m3_s)}: "
            f"read as {number(first.entrance_m3_s)} and {number(first.middle_m3_s)}, their "
            "exponent a slip."
        )
    yield _sphere_as_cylinder()
    yield (
        "Eq. 11 gives the weight phi to the upper bound, Eqs. 15 and 16 give it to the lower one. "
        "Both are the same for phi = 0.5 alone; Eq. 11 is the definition here."
    )


def _sphere_as_cylinder() -> str:
    """What Eq. 20 makes of a sphere."""
    by_volume = law.free_flight_by_volume_m_s(MAIN_GRADIENT_PA_M)
    return (
        "Eq. 20 pushes with 2πr³∇p, as on a cylinder as long as a sphere is wide; a constant "
        "gradient pushes on a sphere with 4/3 πr³∇p. With that a lone particle would go at "
        f"{number(1e3 * by_volume)} mm/s at {MAIN_GRADIENT_PA_M:g} Pa/m, "
        f"{number(by_volume / _free_flight(), 2)} of the {number(1e3 * _free_flight())} here. The "
        "simulations have Eq. 20, and the drag of a lone sphere however densely they lie: these "
        "are the paper's model."
    )
