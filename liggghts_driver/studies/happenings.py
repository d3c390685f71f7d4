"""Whether the hard thing of a hard case did happen in a run of it: a tame scene holds as well.

What is measured comes from the frames and the series, as the invariants do. The numbers that are
wanted lie well below those of the scenes as they are, so that another step or another machine
changes nothing, and well above those of a tame scene.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.contacts import largest_over_radius
from liggghts_driver.physics.drag import BRANCHES, drag_coefficient_n_s_m, reynolds
from liggghts_driver.physics.oscillation import swing
from liggghts_driver.studies.energy import piston_velocity_m_s
from liggghts_driver.studies.seen import (
    at_once,
    hits,
    piston_retreats,
    retreats_m,
    share_in_contact,
    share_touching,
    touching,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from liggghts_driver.studies.energy import Ran

#: A place is "to the last digit" within the rounding of numbers below a metre.
_EXACTLY_M = 1e-15
#: Beside which every speed is large: a share of none is none.
_NO_SPEED_M_S = 1e-300


@dataclass(frozen=True)
class Wanted:
    """One thing that is to happen: how much of it there was, and how much it takes."""

    what: str
    found: float
    least: float = -math.inf
    most: float = math.inf

    @property
    def there(self) -> bool:
        """Whether it happened; what is no number did not."""
        return self.least <= self.found <= self.most

    @property
    def sentence(self) -> str:
        """The number found and the number wanted."""
        wanted = f"at least {self.least:.4g}"
        if self.found > self.most or math.isinf(self.least):
            wanted = f"at most {self.most:.4g}"
        return f"{self.what}: {self.found:.4g}, {wanted} wanted"


def what_is_missing(name: str, ran: Ran) -> str:
    """What did not happen that makes a case hard, in a sentence; empty where all did.

    Parameters
    ----------
    name
        Of the hard case. Of one that is not expected to hold nothing is asked.
    ran
        A run of it.
    """
    wanted = HAPPENINGS.get(name, _nothing)(ran)
    return next((each.sentence for each in wanted if not each.there), "")


def _nothing(_ran: Ran) -> Iterable[Wanted]:
    return ()


def _pressed_in_a_thick_fluid(ran: Ran) -> Iterator[Wanted]:
    fluid = ran.case.scene.dragging_fluid
    assert fluid is not None
    radii = ran.case.population.particle_radii_m
    drag = drag_coefficient_n_s_m(fluid.density, fluid.viscosity, radii, 0.0)
    number = ran.case.time.step_s * (drag / ran.masses_kg).max(initial=0.0)
    yield Wanted("K dt / m", float(number), 1e4)
    yield Wanted("share of frames with touching pairs", share_touching(ran, "particles"), 0.5)


def _stiff(ran: Ran) -> Iterator[Wanted]:
    yield Wanted("Young's modulus [Pa]", ran.case.scene.particles.youngs_modulus, 1e11)
    yield Wanted("hits of one of six spheres", float(hits(ran).sum()), 20.0)


def _soft(ran: Ran) -> Iterator[Wanted]:
    yield Wanted("Young's modulus [Pa]", ran.case.scene.particles.youngs_modulus, most=1e4)
    deepest = max(largest_over_radius(list(found.values())) for found in touching(ran))
    yield Wanted("overlap / radius", deepest, 0.02)
    yield Wanted("share of the time that a sphere touches something", share_in_contact(ran), 0.25)


def _sizes(ratio: float, ran: Ran) -> Iterator[Wanted]:
    radii = ran.case.population.particle_radii_m
    # Radii in a file have some fifteen digits.
    yield Wanted("largest over smallest radius", float(radii.max() / radii.min()), ratio - 1e-9)
    largest, met = int(radii.argmax()), set()
    for found in touching(ran):
        if pairs := found.get("particles"):
            ends = zip(pairs.first.tolist(), pairs.second.tolist(), strict=True)
            met |= {frozenset(pair) for pair in ends if largest in pair}
    yield Wanted("small spheres that the large one meets", float(len(met)), 1.0)


def _thrown_back_again_and_again(ran: Ran) -> Iterator[Wanted]:
    far = piston_retreats(ran) > 0.5
    yield Wanted("retreats of the piston by half a radius", float(far.sum()), 2.0)


def _jammed(ran: Ran) -> Iterator[Wanted]:
    share = share_touching(ran, "piston", "particles", "grains", since=0.5)
    yield Wanted("share of the second half in which piston, bed and grains touch", share, 0.9)


def _blocked(ran: Ran) -> Iterator[Wanted]:
    yield Wanted("friction", ran.case.scene.contact.friction, 0.5)
    back = float(piston_retreats(ran).max(initial=0.0))
    yield Wanted("retreat of the piston over the radius", back, 0.05)


def _all_hit(ran: Ran) -> Iterator[Wanted]:
    yield Wanted("spheres that were hit", float(hits(ran).any(axis=0).sum()), 4.0)


def _every_branch(ran: Ran) -> Iterator[Wanted]:
    fluid = ran.case.scene.dragging_fluid
    assert fluid is not None
    speeds = np.linalg.norm(ran.velocities_m_s[[0, -1]], axis=2)
    radii = ran.case.population.particle_radii_m
    first, last = reynolds(fluid.density, fluid.viscosity, radii, speeds)
    for border in (branch.up_to for branch in BRANCHES[:-1]):
        crossing = (first > border) & (last < border)
        yield Wanted(f"spheres that cross Re = {border:g}", float(crossing.sum()), 1.0)


def _overlapping_start(ran: Ran) -> Iterator[Wanted]:
    start = largest_over_radius(list(next(touching(ran)).values()))
    yield Wanted("overlap / radius at the start", start, 0.005)
    yield from _pushed_from_rest(ran)


def _pushed_from_rest(ran: Ran) -> Iterator[Wanted]:
    still = ~ran.velocities_m_s[0].any(axis=1)
    moved = ran.velocities_m_s[-1].any(axis=1)
    yield Wanted("spheres at rest that are pushed", float((still & moved).sum()), 2.0)


def _on_planes(ran: Ran) -> Iterator[Wanted]:
    layout, places = ran.case.layout, ran.positions_m[0]
    # From the centres to the planes on both sides, (particles, 6).
    distances = np.hstack([places - np.array(layout.low), np.array(layout.high) - places])
    radii = ran.case.population.particle_radii_m
    touched = np.abs(distances - radii[:, None]) <= _EXACTLY_M
    planes = touched.sum(axis=1)
    for name, count in (("a wall", 1), ("an edge", 2), ("a corner", 3)):
        yield Wanted(f"spheres exactly at {name}", float((planes == count).sum()), 1.0)
    yield Wanted("walls that are touched exactly", float(touched.any(axis=0).sum()), 6.0)
    yield Wanted("spheres that were hit", float(hits(ran).any(axis=0).sum()), 3.0)


def _on_section(ran: Ran) -> Iterator[Wanted]:
    first, last = ran.positions_m[[0, -1], :, 0]
    yield Wanted("centres on the section plane", float((first == 0.0).sum()), 2.0)
    crossed = (first == 0.0) & (last > 0.0)
    yield Wanted("of them driven into the pores", float(crossed.sum()), 2.0)


def _one(ran: Ran) -> Iterator[Wanted]:
    yield Wanted("particles", float(ran.case.population.particles), 1.0, 1.0)
    upwards = ran.velocities_m_s[:, :, 2] > 0.0
    bounces = upwards[1:] & ~upwards[:-1]
    yield Wanted("bounces", float(bounces.sum()), 10.0)


def _none(ran: Ran) -> Iterator[Wanted]:
    yield Wanted("particles", float(ran.case.population.particles), most=0.0)
    place = ran.series["piston_x_m"].to_numpy()
    # A t^2 / 2 of the scene is ten times as far.
    yield Wanted("way of the piston [m]", float(place[-1] - place[0]), 1e-4)


def _driven_in(ran: Ran) -> Iterator[Wanted]:
    pressure = ran.case.scene.pressure
    assert pressure is not None
    yield Wanted("gradient [Pa/m]", pressure.gradient, 1e4)
    yield Wanted("particles within the specimen", at_once(ran.positions_m[:, :, 0] > 0.0), 10.0)
    grains = share_touching(ran, "grains")
    yield Wanted("share of frames in which grains are touched", grains, 0.2)


def _driven_out(ran: Ran) -> Iterator[Wanted]:
    first, last = ran.positions_m[[0, -1], :, 0]
    out = (first > 0.0) & (last < 0.0)
    yield Wanted("particles driven out of the pores", float(out.sum()), 4.0)
    piston = share_touching(ran, "piston")
    yield Wanted("share of frames in which the piston is touched", piston, 0.2)


def _to_and_fro(ran: Ran) -> Iterator[Wanted]:
    pressure = ran.case.scene.pressure
    assert pressure is not None
    signs = np.sign(swing(ran.times_s, pressure.period))
    yield Wanted("changes of the gradient's sign", float((signs[1:] != signs[:-1]).sum()), 2.0)
    radius = float(ran.case.population.particle_radii_m.min())
    place = ran.positions_m[:, :, 0].mean(axis=1) / radius
    there, back = retreats_m(-place).max(initial=0.0), retreats_m(place).max(initial=0.0)
    yield Wanted("way of the bed forth over the radius", float(there), 1.0)
    yield Wanted("way of the bed back over the radius", float(back), 1.0)


def _never_slips(ran: Ran) -> Iterator[Wanted]:
    yield Wanted("friction", ran.case.scene.contact.friction, 10.0)
    yield Wanted("share of the time that a sphere touches something", share_in_contact(ran), 0.1)


def _fluid_goes_back(ran: Ran) -> Iterator[Wanted]:
    velocity = piston_velocity_m_s(ran.series)
    share = -float(velocity.min()) / max(float(velocity.max()), _NO_SPEED_M_S)
    yield Wanted("speed of the fluid backwards over that forwards", share, 0.01)
    yield Wanted("times that it turns back", float(len(piston_retreats(ran))), 2.0)


def _held_at_the_face(ran: Ran) -> Iterator[Wanted]:
    places, radii = ran.positions_m[:, :, 0], ran.case.population.particle_radii_m
    yield Wanted("particles that entered", at_once(places > 0.0), most=0.0)
    near = at_once((places <= 0.0) & (places > -2.0 * radii))
    yield Wanted("particles at the face", near, 3.0)
    grains = share_touching(ran, "grains")
    yield Wanted("share of frames in which grains are touched", grains, 0.05)


def _springs_of_friction(ran: Ran) -> Iterator[Wanted]:
    """What a checkpoint must keep: friction is at work in the first contact, bodies spin."""
    spins = ran.case.population.spins_rad_s[: ran.case.population.particles]
    yield Wanted("spheres that spin", float(spins.any(axis=1).sum()), 2.0)
    # Across the line of centres, which is nearly x, friction alone changes a velocity.
    change = np.linalg.norm((ran.velocities_m_s[3] - ran.velocities_m_s[0])[:, 1:], axis=1)
    speed = max(float(np.linalg.norm(ran.velocities_m_s[0], axis=1).max()), _NO_SPEED_M_S)
    yield Wanted("velocity that friction changed / speed", float(change.max()) / speed, 0.1)


def _many_steps(ran: Ran) -> Iterator[Wanted]:
    yield Wanted("steps", float(ran.case.time.steps), 1e7)
    layout = ran.case.layout
    free = layout.high[0] - layout.low[0] - 2.0 * float(ran.case.population.radii_m.max())
    speed = float(np.linalg.norm(ran.velocities_m_s, axis=2).mean())
    # More fall between two frames than frames could tell.
    yield Wanted("collisions: way over the free way", speed * float(ran.times_s[-1]) / free, 1000.0)


HAPPENINGS: Mapping[str, Callable[[Ran], Iterable[Wanted]]] = {
    "micrometre_viscous": _pressed_in_a_thick_fluid,
    "stiff_contacts": _stiff,
    "soft_contacts": _soft,
    "size_ratio_10": partial(_sizes, 10.0),
    "size_ratio_30": partial(_sizes, 30.0),
    "size_ratio_50": partial(_sizes, 50.0),
    "piston_at_speed": _thrown_back_again_and_again,
    "jammed_bed": _jammed,
    "blocked_inlet": _blocked,
    "restitution_lowest": _all_hit,
    "restitution_half": _all_hit,
    "restitution_one": _all_hit,
    "reynolds_all": _every_branch,
    "overlapping_start": _overlapping_start,
    "on_wall_and_edge": _on_planes,
    "on_section": _on_section,
    "one_particle": _one,
    "no_particle": _none,
    "gradient_thousandfold": _driven_in,
    "gradient_negative": _driven_out,
    "gradient_changes_sign": _to_and_fro,
    "friction_ten": _never_slips,
    "fluid_reverses": _fluid_goes_back,
    "no_wide_pores": _held_at_the_face,
    "restart_in_contact": _springs_of_friction,
    "ten_million_steps": _many_steps,
}
