"""What a scene's tables must be to one another: the mistakes that no single key shows.

Each check yields every mistake it finds, so that one message can name them all.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from liggghts_driver.physics.contact import Body, effective_modulus_pa
from liggghts_driver.scene.elastic import bodies_of, elastic
from liggghts_driver.scene.layout import layout, particle_fraction

if TYPE_CHECKING:
    from collections.abc import Iterator

    from liggghts_driver.scene.model import Box, Radii, Scene


@dataclass(frozen=True)
class Mistake:
    """One thing wrong with a scene: the key, its value, the bound it breaks, what to do."""

    name: str
    value: object
    bound: str
    fix: str

    def __str__(self) -> str:
        shown = "(missing)" if self.value is None else f"= {self.value!r}"
        return f"{self.name} {shown}: {self.bound}; {self.fix}"


def scene_mistakes(scene: Scene) -> list[Mistake]:
    """Every contradiction between the tables of a scene."""
    checks = (
        _domain, _population, _radii, _specimen, _contact, _near_field, _cohesion, _fluid,
        _pressure, _piston, _time, _spheres,
    )  # fmt: skip
    mistakes = [mistake for check in checks for mistake in check(scene)]
    # How full the suspension is can be asked only of a scene without contradictions.
    return mistakes or list(_fullness(scene))


def _domain(scene: Scene) -> Iterator[Mistake]:
    if scene.specimen is None and scene.box is None:
        yield Mistake("box", None, "a scene needs [specimen] or [box]", "add one of the two")
    if scene.specimen is not None and scene.box is not None:
        yield Mistake("box", "given", "[specimen] already says where the walls are", "remove [box]")
    if scene.box is not None:
        yield from _faces(scene.box)
        for axis, low, high in zip("xyz", scene.box.low, scene.box.high, strict=True):
            if not low < high:
                fix = "give the lower corner first"
                yield Mistake(f"box.high ({axis})", high, f"must be above box.low = {low}", fix)


def _faces(box: Box) -> Iterator[Mistake]:
    twice = sorted({face for face in box.walls if box.walls.count(face) > 1})
    if twice:
        bound = f"{', '.join(twice)} stands there more than once"
        yield Mistake("box.walls", list(box.walls), bound, "name each face once")


def _population(scene: Scene) -> Iterator[Mistake]:
    particles = scene.particles
    wanted = [name for name in ("count", "volume_fraction") if getattr(particles, name) is not None]
    if wanted and particles.radius_mean is None:
        bound = f"particles.{wanted[0]} asks for particles of some size"
        yield Mistake("particles.radius_mean", None, bound, "give their mean radius in m")
    if scene.specimen is None:
        nothing = not particles.count and particles.volume_fraction is None
        if nothing and not scene.spheres:
            fix = "give particles.count, particles.volume_fraction or [[spheres]]"
            yield Mistake("spheres", None, "the scene has nothing in it", fix)
        if len(wanted) == 2:
            bound = "particles.volume_fraction and the box already fix the number"
            yield Mistake("particles.count", particles.count, bound, "remove one of the two")
        return
    given = [*wanted, *(["length"] if scene.reservoir.length is not None else [])]
    if len(given) != 2:
        names = "particles.count, particles.volume_fraction, reservoir.length"
        yield Mistake(names, given, "exactly two of the three fix the suspension", "give two")


def _radii(scene: Scene) -> Iterator[Mistake]:
    tables: list[tuple[str, Radii | None]] = [
        ("particles", scene.particles),
        ("grains", scene.grains),
    ]
    for name, table in tables:
        if table is None or table.radius_mean is None:
            continue
        smallest = table.radius_mean - table.radius_truncation * table.radius_deviation
        if smallest <= 0:
            yield Mistake(
                f"{name}.radius_deviation",
                table.radius_deviation,
                f"the smallest radius would be {smallest:.3g} m",
                "lower the deviation or radius_truncation",
            )


def _specimen(scene: Scene) -> Iterator[Mistake]:
    specimen = scene.specimen
    fixed = any(sphere.kind == "grain" for sphere in scene.spheres)
    if scene.grains is None and (specimen is not None or fixed):
        yield Mistake("grains", None, "the scene has fixed grains", "add [grains]")
    if specimen is None:
        return
    if scene.grains is not None and scene.grains.radius_mean is None:
        yield Mistake(
            "grains.radius_mean", None, "the specimen is made of grains", "give their mean radius"
        )
    if specimen.permeability_matrix < specimen.permeability_grains:
        yield Mistake(
            "specimen.permeability_matrix",
            specimen.permeability_matrix,
            f"Eqs. 9-10 need P_2 >= P_1 = {specimen.permeability_grains}",
            "phase 2 is the more permeable one",
        )


def _contact(scene: Scene) -> Iterator[Mistake]:
    contact = scene.contact
    if (contact.damping_ratio is None) == (contact.restitution is None):
        given = None if contact.damping_ratio is None else "both given"
        yield Mistake(
            "contact.damping_ratio, contact.restitution", given, "exactly one is needed", "give one"
        )
    if contact.rolling_friction > 0 and contact.friction == 0:
        yield Mistake(
            "contact.rolling_friction",
            contact.rolling_friction,
            "without friction nothing makes a sphere roll",
            "set contact.friction above 0, or rolling_friction = 0",
        )


def _near_field(scene: Scene) -> Iterator[Mistake]:
    """The sine falls from contact to its end only if it reaches less than a diameter."""
    if scene.near_field is None:
        return
    reach = scene.near_field.reach
    radius = scene.particles.radius_mean or min(
        (sphere.radius for sphere in scene.spheres if sphere.kind == "particle"), default=math.inf
    )
    if reach >= 2.0 * radius:
        bound = f"must be below the particles' diameter, {2.0 * radius:g} m"
        yield Mistake("near_field.reach", reach, bound, "shorten it")


def _cohesion(scene: Scene) -> Iterator[Mistake]:
    """Cohesion must not press bodies together further than an overlap may be.

    Without a load Hertz's repulsion 4/3 E* sqrt(r*) d^1.5 balances the attraction 2 pi r* C d at
    d = r* (3 pi C / 2 E*)^2, most for a wall, whose r* is the particle's radius.
    """
    density = scene.contact.cohesion_energy_density
    bodies = (Body(math.inf, math.inf, *elastic(scene, kind)) for kind in bodies_of(scene))
    particle, *others = bodies
    softest = min(effective_modulus_pa(particle, other) for other in (particle, *others))
    largest = 2.0 * softest / (3.0 * math.pi) * math.sqrt(scene.contact.largest_overlap)
    if density > largest:
        yield Mistake(
            "contact.cohesion_energy_density",
            density,
            f"bodies would overlap by more than contact.largest_overlap = "
            f"{scene.contact.largest_overlap:g} of a radius by themselves",
            f"give at most {largest:.3g} J/m3, stiffer bodies, or a larger overlap",
        )


def _fluid(scene: Scene) -> Iterator[Mistake]:
    fluid = scene.fluid
    if fluid is None:
        return
    if fluid.velocity_outside == "piston" and scene.piston is None:
        fix = "add [piston], or choose accelerating, constant or still"
        yield Mistake("fluid.velocity_outside", "piston", "the scene has no piston", fix)
    unpushed = fluid.acceleration is None and scene.piston is None
    if fluid.velocity_outside == "accelerating" and unpushed:
        fix = "give fluid.acceleration in m/s2"
        yield Mistake("fluid.acceleration", None, "the scene has no piston to take it from", fix)
    if fluid.velocity_inside == "pore" and scene.specimen is None:
        fix = 'use "still"'
        yield Mistake("fluid.velocity_inside", "pore", "the scene has no specimen", fix)
    if scene.drag.scheme == "implicit" and scene.drag.carrier == "addforce":
        bound = "the implicit scheme is the coupling's own"
        yield Mistake("drag.carrier", "addforce", bound, "use coupling, or drag.scheme = held")


def _pressure(scene: Scene) -> Iterator[Mistake]:
    """The pore velocity is that of Darcy's law, which is about a steady flow."""
    pressure, fluid = scene.pressure, scene.fluid
    if pressure is None or pressure.period is None or fluid is None:
        return
    if fluid.velocity_inside == "pore":
        bound = "Darcy's pore velocity belongs to a constant gradient; this one has a period"
        fix = 'use "still", or remove pressure.period'
        yield Mistake("fluid.velocity_inside", "pore", bound, fix)


def _piston(scene: Scene) -> Iterator[Mistake]:
    if scene.piston is None:
        return
    if scene.box is not None and "x-" in scene.box.walls:
        yield Mistake("box.walls", "x-", "the piston stands there", "remove x- from box.walls")
    particles = scene.particles
    empty = particles.count == 0 or (particles.count, particles.volume_fraction) == (None, None)
    if empty and scene.piston.mass is None:
        fix = "give its mass in kg"
        yield Mistake("piston.mass", None, "there is no suspension to take it from", fix)


def _time(scene: Scene) -> Iterator[Mistake]:
    step, duration = scene.time.step, scene.time.duration
    if step is not None and step * scene.output.samples > duration * (1 + 1e-9):
        yield Mistake(
            "time.step",
            step,
            f"output.samples = {scene.output.samples} rows need as many steps in {duration} s",
            "shorten the step or lower output.samples",
        )


def _spheres(scene: Scene) -> Iterator[Mistake]:
    yield from _coincident(scene)
    if scene.box is None:
        return
    for number, sphere in enumerate(scene.spheres):
        limits = zip("xyz", sphere.position, scene.box.low, scene.box.high, strict=True)
        for axis, place, low, high in limits:
            if not low <= place <= high:
                yield Mistake(
                    f"spheres[{number}].position ({axis})",
                    place,
                    f"must be inside the box, [{low}, {high}]",
                    "move the sphere or enlarge the box",
                )


def _coincident(scene: Scene) -> Iterator[Mistake]:
    """Two spheres with one centre: no direction in which they could repel each other."""
    first: dict[tuple[float, float, float], int] = {}
    for number, sphere in enumerate(scene.spheres):
        other = first.setdefault(sphere.position, number)
        if other != number:
            bound = f"spheres[{other}] has the same centre"
            name = f"spheres[{number}].position"
            yield Mistake(name, list(sphere.position), bound, "move one of them")


def _fullness(scene: Scene) -> Iterator[Mistake]:
    place = layout(scene)
    if scene.box is not None and place.fill_high[0] > place.high[0]:
        bound = f"the box is {place.high[0] - place.low[0]:g} m long"
        yield Mistake("reservoir.length", scene.reservoir.length, bound, "shorten it")
        return
    fraction = particle_fraction(scene, place)
    if fraction >= 1:
        bound = f"these particles would fill {fraction:.3g} of the volume they are to be in"
        yield Mistake("particles.count", scene.particles.count, bound, "lower it")
