"""Effects: what a scene calls for is in with its reason, all else is out with its reason."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from small_scenes import COLLISION, FLUID, GONE, GRAIN, INFILTRATION, case_of, scene_of

from liggghts_driver.effects import EFFECTS, active_effects, decide_effects
from liggghts_driver.effects.contacts import pairwise, restitution
from liggghts_driver.effects.drag import uses_coupling
from liggghts_driver.effects.piston import piston_stl, speed_limit_m_s
from liggghts_driver.effects.scales import scales_of
from liggghts_driver.errors import SceneError
from liggghts_driver.resources import templates_dir

GRAVITY = {"acceleration": [0.0, 0.0, -9.81]}
GRAINS = {"youngs_modulus": 1.0e6, "poissons_ratio": 0.25}
PISTON = {"acceleration": 2.0, "mass": 0.5}

#: What switches an effect on in the scene that has only contacts.
SWITCHES = {
    "friction": {"contact.friction": 0.3},
    "rolling": {"contact.friction": 0.3, "contact.rolling_friction": 0.1},
    "cohesion": {"contact.cohesion_energy_density": 1.0e4},
    "near_field": {"near_field": {"force": 1e-6, "reach": 5e-4}},
    "grains": {"spheres": [*COLLISION["spheres"], GRAIN], "grains": GRAINS},
    "walls": {"box.walls": ["x+", "z-"]},
    "piston": {"piston": PISTON},
    "pressure": {"pressure": {"gradient": 10.0}},
    "drag": {"fluid": FLUID},
    "gravity": {"gravity": GRAVITY},
    "buoyancy": {"gravity": GRAVITY, "fluid": FLUID},
    "rotation": {"contact.friction": 0.3},
}
#: What comes along with it.
ALONG = {
    "friction": {"rotation"},
    "rolling": {"friction", "rotation"},
    "rotation": {"friction"},
    "buoyancy": {"gravity", "drag"},
}


def names(tables, changes=None) -> set[str]:
    return {effect.name for effect in active_effects(scene_of(tables, changes))}


def test_contacts_alone():
    assert names(COLLISION) == {"contacts"}


@pytest.mark.parametrize("effect", SWITCHES)
def test_a_switch_brings_its_effect_and_no_other(effect):
    assert names(COLLISION, SWITCHES[effect]) == {"contacts", effect} | ALONG.get(effect, set())


def test_every_effect_has_its_switch_and_its_template():
    assert {effect.name for effect in EFFECTS} == {"contacts", *SWITCHES}
    for scheme in ("exact", "held", "implicit"):
        case = case_of(INFILTRATION, {"drag.scheme": scheme})
        for effect in EFFECTS:
            assert (templates_dir() / effect.fragment(case)).is_file()


def test_the_papers_problem():
    assert names(INFILTRATION) == {"contacts", "grains", "walls", "piston", "pressure", "drag"}


@pytest.mark.parametrize(
    "changes",
    [
        {"pressure": {"gradient": 0.0}},
        {"gravity": {"acceleration": [0.0, 0.0, 0.0]}, "fluid": FLUID},
        {"contact.friction": 0.0},
        {"contact.cohesion_energy_density": 0.0},
    ],
    ids=str,
)
def test_what_is_zero_is_out(changes):
    assert names(COLLISION, changes) <= {"contacts", "drag"}


@pytest.mark.parametrize("tables", [COLLISION, INFILTRATION], ids=["collision", "infiltration"])
def test_every_decision_has_a_reason(tables):
    decisions = decide_effects(scene_of(tables))
    assert [decision.effect for decision in decisions] == list(EFFECTS)
    assert all(decision.reason and decision.effect.title for decision in decisions)


def test_reasons_name_what_decides():
    reasons = {
        decision.effect.name: decision.reason
        for decision in decide_effects(
            scene_of(INFILTRATION, {"gravity": GRAVITY, "contact.friction": 0.25})
        )
    }
    assert "0.25" in reasons["friction"]
    assert "rolling_friction = 0" in reasons["rolling"]
    assert "cohesion energy density 0" in reasons["cohesion"]
    assert "10 Pa/m inside" in reasons["pressure"]
    assert "0.001 Pa s" in reasons["drag"]
    assert "9.81" in reasons["gravity"]
    assert "0.286" in reasons["buoyancy"]  # 2000 / 7000
    assert "0.002143" in reasons["piston"]


def test_restitution_is_as_given_or_from_the_damping_ratio():
    assert restitution(scene_of(COLLISION)) == pytest.approx(0.707, abs=5e-4)  # physics.md
    changes = {"contact.damping_ratio": GONE, "contact.restitution": 0.4}
    assert restitution(scene_of(COLLISION, changes)) == 0.4


def test_one_value_for_every_pair_of_materials():
    words = pairwise(case_of(INFILTRATION), 0.25).split()
    assert words == ["3", *["0.25"] * 9]


@pytest.mark.parametrize(
    ("changes", "carried"),
    [
        ({"drag.scheme": "held"}, True),
        ({"drag.scheme": "implicit"}, True),
        ({"drag.carrier": "addforce"}, True),
        ({"drag.scheme": "exact"}, False),
        ({"fluid": GONE, "piston.mass": 1.0}, False),
    ],
    ids=str,
)
def test_a_drag_that_is_kept_carries_the_pressure(changes, carried):
    case = case_of(INFILTRATION, changes)
    (pressure,) = (effect for effect in EFFECTS if effect.name == "pressure")
    assert ("carried" in pressure.fragment(case)) == carried


@pytest.mark.parametrize(
    ("changes", "scheme"),
    [
        ({"drag.scheme": "exact"}, "exact"),
        ({"drag.scheme": "held"}, "held"),
        ({"drag.scheme": "implicit"}, "implicit"),
        ({}, "held"),
        ({"fluid.viscosity": 10.0}, "implicit"),
    ],
    ids=str,
)
def test_the_fragment_of_a_drag_is_that_of_its_plan(changes, scheme):
    case = case_of(INFILTRATION, changes)
    (drag,) = (effect for effect in EFFECTS if effect.name == "drag")
    assert drag.fragment(case) == f"effects/drag_{scheme}.j2"
    assert (drag.refresh(case) is None) == (scheme == "exact")


@pytest.mark.parametrize(
    ("changes", "coupled"),
    [
        ({"drag.scheme": "held"}, True),
        ({"drag.scheme": "implicit"}, True),
        ({"drag.scheme": "exact"}, False),
        ({"drag.carrier": "addforce"}, False),
        ({"fluid": GONE, "piston.mass": 1.0}, False),
    ],
    ids=str,
)
def test_what_is_kept_asks_for_the_coupling(changes, coupled):
    assert uses_coupling(case_of(INFILTRATION, changes)) == coupled


class TestBondNumber:
    """Pull-off over the largest other force, of what a mean particle sticks to most."""

    def weight(self, tables, changes):
        (cohesion,) = (effect for effect in EFFECTS if effect.name == "cohesion")
        case = case_of(tables, {"contact.cohesion_energy_density": 2.0e4, **changes})
        return case, cohesion.weigh(case)

    def test_two_spheres_that_fall(self):
        case, weight = self.weight(COLLISION, {"gravity": GRAVITY})
        modulus = 1.0e7 / 2 / (1 - 0.25**2)
        pull_off = 2 / 3 * math.pi**3 * 2.0e4**3 * 0.00075**2 / modulus**2
        # Falling through the box they gain more speed than their weight could stop within it.
        load = scales_of(case).inertia_n
        assert load > scales_of(case).weight_n
        assert weight.value == pytest.approx(pull_off / load, rel=1e-12)
        assert weight.share == pytest.approx(min(1.0, pull_off / load), rel=1e-12)

    def test_a_wall_holds_more_than_a_sphere(self):
        """A plane has twice the effective radius of an equal sphere, so four times the force."""
        _, without = self.weight(COLLISION, {"gravity": GRAVITY})
        _, beside = self.weight(COLLISION, {"gravity": GRAVITY, "box.walls": ["z-"]})
        assert beside.value == pytest.approx(4.0 * without.value, rel=1e-12)

    def test_a_soft_large_grain_holds_most(self):
        """Its radius of 10 particles' and a tenth of their modulus outdo a wall."""
        grains = {
            "spheres": [
                *COLLISION["spheres"],
                {**GRAIN, "radius": 0.015, "position": [0.02, 0.0, 0.0]},
            ],
            "grains": GRAINS,
        }
        changes = {"gravity": GRAVITY, "box.walls": ["z-"], "box.high": [0.04, 0.02, 0.02]}
        _, wall = self.weight(COLLISION, changes)
        _, grain = self.weight(COLLISION, {**changes, **grains})
        # r* = 15/11 mm against 1.5 mm; E* as 1/(1 + 10) against 1/(1 + 1): F goes as (r*/E*)^2.
        assert grain.value == pytest.approx((10 / 11 * 11 / 2) ** 2 * wall.value, rel=1e-12)

    def test_no_share_is_above_one(self):
        """At rest, and with nothing else to move it, a particle moves as cohesion has it."""
        still = [{**sphere, "velocity": [0.0, 0.0, 0.0]} for sphere in COLLISION["spheres"]]
        _, weight = self.weight(COLLISION, {"spheres": still, "time.step": 1e-6})
        assert weight.value > 1.0
        assert weight.share == 1.0


class TestPiston:
    """Newton's law from a servo, its limit out of reach but inside what the skin allows."""

    def values(self, changes=None):
        case = case_of(INFILTRATION, changes)
        (piston,) = (effect for effect in EFFECTS if effect.name == "piston")
        return case, piston.values(case)

    def test_servo_is_newtons_law(self):
        case, values = self.values()
        assert values["force"] == pytest.approx(case.piston_mass_kg * 2.143e-3, rel=1e-12)
        # v = limit x gain / F x integral of F dt = a t.
        speed_per_time = values["limit"] * values["gain"]
        assert speed_per_time == pytest.approx(2.143e-3, rel=1e-12)

    def test_limit(self):
        case, values = self.values()
        limit = values["limit"]
        assert limit == speed_limit_m_s(case)
        assert limit < case.skin_m / (2 * case.time.step_s)
        assert limit >= 2 * case.speed_bound_m_s

    def test_a_step_that_leaves_no_room_is_refused_with_one_that_does(self):
        changes = {
            "piston": {"acceleration": 5.0, "mass": 1.0},
            "particles.youngs_modulus": 10.0,
            "time.step_fraction": 1.0,
        }
        case = case_of(INFILTRATION, changes)
        speed_limit_m_s(case)  # the step that was chosen leaves room
        contact = min(b.step_s for b in case.time.bounds if b.name.startswith("contact"))
        longer = replace(case, time=replace(case.time, step_s=contact))
        with pytest.raises(SceneError, match=r"time\.step.*at most") as caught:
            speed_limit_m_s(longer)
        allowed = float(str(caught.value).split("at most ")[1].split()[0])
        # The message rounds to three digits.
        speed_limit_m_s(replace(case, time=replace(case.time, step_s=0.99 * allowed)))

    def test_surface_faces_plus_x_and_covers_the_channel(self):
        case = case_of(INFILTRATION, {"specimen.height": 0.03})
        lines = piston_stl(case).splitlines()
        assert lines[0] == "solid piston"
        assert lines[-1] == "endsolid piston"
        vertices = [tuple(map(float, line.split()[1:])) for line in lines if "vertex" in line]
        assert len(vertices) == 6
        area = 0.0
        for a, b, c in (vertices[:3], vertices[3:]):
            (ux, uy, uz), (vx, vy, vz) = (
                tuple(q - p for p, q in zip(a, corner, strict=True)) for corner in (b, c)
            )
            normal = (uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx)
            # By the right-hand rule of the vertices, as the stated normal says.
            assert normal[0] > 0
            assert normal[1:] == (0.0, 0.0)
            area += normal[0] / 2
        assert lines[1].split() == ["facet", "normal", "1", "0", "0"]
        assert {x for x, _, _ in vertices} == {case.layout.low[0]}
        ys, zs = {y for _, y, _ in vertices}, {z for _, _, z in vertices}
        assert min(ys) < case.layout.low[1]
        assert max(ys) > case.layout.high[1]
        assert min(zs) < case.layout.low[2]
        assert max(zs) > case.layout.high[2]
        # Two triangles make the whole rectangle.
        whole = (max(ys) - min(ys)) * (max(zs) - min(zs))
        assert area == pytest.approx(whole, rel=1e-12)
