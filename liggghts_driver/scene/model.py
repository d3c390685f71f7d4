"""The scene: what a user says about a problem, checked and frozen.

Every table of the TOML file is one class here, every key one field. All values are SI; the unit
and the meaning of a key stand in its field, from which the error messages, the JSON schema and
the documentation are made.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel

from liggghts_driver.scene.accuracy import MEANING, AccuracyKey
from liggghts_driver.scene.fields import (
    Face,
    FrozenDict,
    Line,
    Number,
    Numbers,
    Switch,
    Table,
    Vector,
    Whole,
    key,
)


class Fluid(Table):
    """The base fluid (the solvent, without its particles)."""

    density: Number = key("kg/m3", "mass density of the base fluid, rho_f", gt=0)
    viscosity: Number = key("Pa s", "dynamic viscosity of the base fluid, mu_f", gt=0)
    velocity_outside: Literal["piston", "accelerating", "constant", "still"] = key(
        "",
        "fluid velocity outside the specimen: that of the piston, `acceleration` x time "
        "(the paper's text), `velocity`, or zero",
        "still",
    )
    velocity: Number = key("m/s", "fluid velocity along x for velocity_outside = constant", 0.0)
    acceleration: Number | None = key(
        "m/s2",
        "acceleration along x for velocity_outside = accelerating; default: the piston's",
        None,
    )
    velocity_inside: Literal["still", "pore"] = key(
        "",
        "fluid velocity inside the specimen: zero (the paper), or the Darcy pore velocity q / v2",
        "still",
    )


class Material(Table):
    """Elastic properties of one kind of body."""

    youngs_modulus: Number = key("Pa", "Young's modulus", gt=0)
    poissons_ratio: Number = key("", "Poisson's ratio", ge=0, le=0.5)


class Radii(Table):
    """A Gaussian distribution of radii, truncated on both sides."""

    radius_mean: Number | None = key("m", "mean radius", None, gt=0)
    radius_deviation: Number = key("m", "standard deviation of the radius", 0.0, ge=0)
    radius_truncation: Number = key(
        "", "radii further from the mean than this many deviations do not occur", 3.0, gt=0
    )


class Particles(Material, Radii):
    """The particles that the fluid carries."""

    density: Number = key("kg/m3", "mass density of a particle, rho_p", gt=0)
    volume_fraction: Number | None = key(
        "", "volume of particles per volume of suspension, v_p", None, gt=0, lt=1
    )
    count: Whole | None = key("", "number of particles", None, ge=0)


class Grains(Material, Radii):
    """The fixed grains of the specimen."""

    density: Number | None = key(
        "kg/m3",
        "mass density (of no effect, they are fixed); default: the particles'",
        None,
        gt=0,
    )


class Sphere(Table):
    """One sphere at a given place: a particle, or a fixed grain."""

    kind: Literal["particle", "grain"] = key("", "particle (moves) or grain (fixed)", "particle")
    radius: Number = key("m", "radius", gt=0)
    position: Vector = key("m", "centre")
    velocity: Vector = key("m/s", "initial velocity", (0.0, 0.0, 0.0))
    spin: Vector = key("rad/s", "initial angular velocity", (0.0, 0.0, 0.0))


class Contact(Table):
    """How bodies touch: the same for every pair of materials, as in the paper."""

    damping_ratio: Number | None = key(
        "", "ratio xi_n of the normal damping to the critical one", None, ge=0, le=0.62
    )
    restitution: Number | None = key(
        "", "coefficient of normal restitution, instead of damping_ratio", None, gt=0.05, le=1
    )
    friction: Number = key("", "Coulomb friction coefficient, mu_S = mu_D", 0.0, ge=0)
    rolling_friction: Number = key("", "rolling resistance coefficient, mu_R", 0.0, ge=0)
    cohesion_energy_density: Number = key(
        "J/m3",
        "attraction of bodies that touch, per area in which they cut each other; none across a gap",
        0.0,
        ge=0,
    )
    stiffness_scale: Number = key(
        "",
        "factor on every Young's modulus: softer contacts last longer, and the step with them, as "
        "its power -0.4",
        1.0,
        gt=0,
        le=1,
    )
    largest_overlap: Number = key(
        "", "largest overlap of a contact, over the smaller radius, in a valid answer", 0.01, gt=0
    )


class NearField(Table):
    """Attraction of particles across a gap: a sine of the distance between their centres."""

    force: Number = key("N", "attraction of two particles of the mean radius that touch", gt=0)
    reach: Number = key("m", "gap between two particles of the mean radius where it ends", gt=0)


class Specimen(Table):
    """The porous solid: grains cut by a cuboid from x = 0 to x = length."""

    length: Number = key("m", "length along the flow", gt=0)
    width: Number = key("m", "width (y) of the specimen and of the channel before it", gt=0)
    height: Number | None = key("m", "height (z); default: the width", None, gt=0)
    solid_fraction: Number = key("", "volume fraction of the grains, v_1", gt=0, lt=1)
    cut: Literal["bulk", "inside"] = key(
        "",
        "bulk: cut from a larger packing, every grain that meets the cuboid is kept; "
        "inside: whole grains inside the cuboid",
        "bulk",
    )
    exit: Literal["closed", "open"] = key("", "the face at x = length: a wall, or none", "closed")
    permeability_grains: Number = key("m2", "permeability of the grains, P_1", gt=0)
    permeability_matrix: Number = key("m2", "permeability of the matrix between them, P_2", gt=0)
    phi: Number = key(
        "", "weight of the upper permeability bound in Eq. 11 (1: upper, 0: lower)", 0.5, ge=0, le=1
    )


class Reservoir(Table):
    """The suspension that waits before the specimen, or in the box."""

    length: Number | None = key(
        "m", "length along x; default: from count and volume_fraction, or the box", None, gt=0
    )


class Box(Table):
    """The domain of a scene without a specimen."""

    low: Vector = key("m", "lower corner")
    high: Vector = key("m", "upper corner")
    walls: tuple[Face, ...] = key("", "the faces that are walls", ())


class Walls(Table):
    """Material of walls and piston; default: the particles'."""

    youngs_modulus: Number | None = key("Pa", "Young's modulus", None, gt=0)
    poissons_ratio: Number | None = key("", "Poisson's ratio", None, ge=0, le=0.5)


class Piston(Table):
    """A rigid plate normal to x, pushed by mass x acceleration and by what it touches."""

    acceleration: Number = key("m/s2", "acceleration of the free piston towards +x", gt=0)
    mass: Number | None = key(
        "kg", "mass; default: that of the suspension before it (particles and fluid)", None, gt=0
    )


class Pressure(Table):
    """The pressure gradient inside the specimen (in a box: everywhere)."""

    gradient: Number = key("Pa/m", "drop of pressure per length towards +x, |grad p|")
    period: Number | None = key("s", "it goes as cos(2 pi t/period); default: constant", None, gt=0)


class Drag(Table):
    """How the drag law (Eqs. 17-19) is integrated."""

    scheme: Literal["auto", "exact", "held", "implicit", "none"] = key(
        "",
        "exact: the full law at every step; held: forces computed now and then and kept in "
        "between; implicit: the engine's own implicit step, coefficients computed now and then; "
        "auto: held where forces may be kept for many steps, else implicit; none: no drag",
        "auto",
    )
    refresh: Number | None = key(
        "s", "time for which a coefficient is kept; default: from tolerance", None, gt=0
    )
    tolerance: Number = key(
        "", "relative error of a velocity that keeping the coefficient may cost", 0.005, gt=0, lt=1
    )
    carrier: Literal["coupling", "addforce"] = key(
        "",
        "what adds a held force at each step: the engine's coupling, which is faster, or "
        "fix addforce, for an engine without the coupling",
        "coupling",
    )


class Gravity(Table):
    """A uniform body acceleration."""

    acceleration: Vector = key("m/s2", "acceleration of gravity", (0.0, 0.0, -9.81))
    buoyancy: Switch = key(
        "", "switch: true if the fluid that particles displace buoys them up", True
    )


class Effects(Table):
    """Which effects a run may leave out."""

    screen: Number = key(
        "",
        "estimated share of the particles' motion below which an effect is left out; 0: none is",
        0.0,
        ge=0,
        lt=1,
    )
    settings: Annotated[dict[str, Numbers], AfterValidator(FrozenDict)] = key(
        "", "numbers of effects that have no table of their own: [effects.settings.NAME]", {}
    )


class Time(Table):
    """Duration and step."""

    duration: Number = key("s", "simulated time", gt=0)
    step: Number | None = key("s", "time step; default: the largest within its bounds", None, gt=0)
    step_fraction: Number = key(
        "",
        "largest step as a fraction of the shortest contact's duration (Eq. 21)",
        0.1,
        gt=0,
        le=1,
    )


class Output(Table):
    """What is kept of a run."""

    samples: Whole = key("", "rows of the time series", 500, ge=10, le=1_000_000)
    frames: Whole = key(
        "", "frames of all particles' positions and velocities", 100, ge=1, le=1_000_000
    )
    images: Whole = key("", "snapshots rendered by the engine", 6, ge=0, le=100_000)
    paraview: Switch = key("", "also write VTK files for ParaView", False)
    flowing_above: Number | None = key(
        "m/s",
        "a particle inside the specimen flows when its x velocity is above this; "
        "default: a tenth of the free-flight velocity of the mean particle",
        None,
        ge=0,
    )


class Scene(Table):
    """One problem, complete."""

    title: Line = key("", "one line for the reports", "")
    seed: Whole = key("", "root of all random numbers", 1, ge=0)
    accuracy: AccuracyKey = key("", MEANING, None)
    particles: Particles
    spheres: tuple[Sphere, ...] = key("", "single spheres at given places", ())
    grains: Grains | None = None
    specimen: Specimen | None = None
    reservoir: Reservoir = Reservoir(length=None)
    box: Box | None = None
    walls: Walls = Walls(youngs_modulus=None, poissons_ratio=None)
    contact: Contact
    near_field: NearField | None = None
    fluid: Fluid | None = None
    piston: Piston | None = None
    pressure: Pressure | None = None
    drag: Drag = Drag()
    gravity: Gravity | None = None
    effects: Effects = Effects()
    time: Time
    output: Output = Output()

    @property
    def dragging_fluid(self) -> Fluid | None:
        """The fluid, if it drags the particles."""
        return None if self.drag.scheme == "none" else self.fluid

    @property
    def buoyed_share(self) -> float:
        """The share of a particle's weight that the displaced fluid carries."""
        if self.fluid is None or self.gravity is None or not self.gravity.buoyancy:
            return 0.0
        return self.fluid.density / self.particles.density


def table_class(annotation: Any) -> type[BaseModel] | None:
    """The table class inside ``Table``, ``Table | None`` or ``tuple[Table, ...]``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    inside = (table_class(argument) for argument in getattr(annotation, "__args__", ()))
    return next((found for found in inside if found), None)
