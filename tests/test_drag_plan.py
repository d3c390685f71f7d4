"""The plan of the drag: which scheme, how long what is computed may be kept, what is refused."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_scenes import COLLISION, FLUID, GONE, GRAIN, INFILTRATION, case_of, changed, scene_of

from liggghts_driver.drag_plan import LONGEST_KEPT, DragPlan, drag_relaxation_s, plan_drag
from liggghts_driver.errors import SceneError
from liggghts_driver.physics.drag import BRANCHES, drag_factor
from liggghts_driver.population import populate
from liggghts_driver.scene.layout import layout

RADIUS = 0.0015
#: One sphere in a fluid, with samples so far apart that they bound nothing.
LONE = changed(
    COLLISION,
    {
        "spheres": [{"radius": RADIUS, "position": [0.0, 0.0, 0.0]}],
        "fluid": FLUID,
        "time.duration": 1.0e6,
        "output.samples": 10,
    },
)
SAMPLES = 1.0e5
#: Slips on each branch of Eq. 18 (Re = 6000 slip), and the largest exponent p up to there.
SLIPS = [(1e-4, 0.0), (1e-2, 0.354), (1.0, 1.0), (100.0, 1.4275), (1000.0, 1.4275)]
SHORT = 1e-9


def plan(
    changes: dict[str, Any] | None = None, slip: float = 0.01, step: float = SHORT, tables=LONE
) -> DragPlan:
    scene = scene_of(tables, changes)
    found = plan_drag(scene, populate(scene, layout(scene)), slip, step)
    assert found is not None
    return found


def relaxation(slip: float, radius: float = RADIUS) -> float:
    """m / K of Eqs. 17-19 [s]: 7000 kg/m3 in a fluid of 2000 kg/m3 and 0.001 Pa s."""
    stokes = 2.0 / 9.0 * 7000.0 * radius**2 / 0.001
    return stokes / float(drag_factor(2.0 * 2000.0 * radius * slip / 0.001))


class TestRelaxation:
    @pytest.mark.parametrize("slip", [slip for slip, _ in SLIPS])
    def test_is_the_mass_over_the_coefficient(self, slip):
        assert plan(slip=slip).relaxation_s == pytest.approx(relaxation(slip), rel=1e-12)

    def test_of_the_quickest_particle(self):
        radii = [0.003, 0.001, 0.002]
        spheres = [
            {"radius": radius, "position": [0.01 * place, 0.0, 0.0]}
            for place, radius in enumerate(radii, -1)
        ]
        scene = scene_of(LONE, {"spheres": spheres})
        found = drag_relaxation_s(scene, populate(scene, layout(scene)), 0.01)
        assert found == pytest.approx(min(relaxation(0.01, r) for r in radii), rel=1e-12)


class TestInterval:
    @pytest.mark.parametrize(("slip", "power"), SLIPS)
    @pytest.mark.parametrize("tolerance", [0.005, 0.02])
    @pytest.mark.parametrize("scheme", ["held", "implicit"])
    def test_follows_from_the_tolerance(self, slip, power, tolerance, scheme):
        found = plan({"drag.scheme": scheme, "drag.tolerance": tolerance}, slip)
        if scheme == "implicit" and power == 0.0:
            expected = SAMPLES  # K is constant: nothing is ever out of date
        else:
            expected = math.sqrt(2 * tolerance) / (1 + power) * relaxation(slip)
        assert found.interval_s == pytest.approx(expected, rel=1e-12)
        assert found.scheme == scheme

    @pytest.mark.parametrize(
        ("end", "next_power"),
        [(branch.up_to, after.power) for branch, after in itertools.pairwise(BRANCHES)],
        ids=str,
    )
    def test_counts_a_branch_from_where_it_starts(self, end, next_power):
        """A branch holds up to its end and the next one beyond it."""
        before = max(b.power for b in BRANCHES if b.up_to <= end)
        after = max(before, next_power)
        for factor, power in [(1 - 1e-9, before), (1 + 1e-9, after)]:
            slip = factor * end / 6000.0
            expected = 0.1 / (1 + power) * relaxation(slip)  # sqrt(2 x 0.005) = 0.1
            assert plan({"drag.scheme": "held"}, slip).interval_s == pytest.approx(expected)

    @pytest.mark.parametrize("power", sorted({branch.power for branch in BRANCHES}))
    @pytest.mark.parametrize("tolerance", [1e-3, 5e-3, 3e-2])
    def test_costs_the_tolerance_at_the_most(self, power, tolerance):
        """The first interval is one step of Euler's, and has the largest error."""
        kept = math.sqrt(2 * tolerance) / (1 + power)  # over m / K
        # dv/dt = -v^(1+p) from v = 1.
        exact = (1 + power * kept) ** (-1 / power) if power else math.exp(-kept)
        wrong = exact - (1 - kept)
        # To second order the error is tolerance / (1 + p); what is left out is of third order,
        # below (1 + p) (1 + 2 p) kept^3 / 6.
        assert wrong <= tolerance
        third = (1 + power) * (1 + 2 * power) * kept**3 / 6
        assert wrong == pytest.approx(tolerance / (1 + power), abs=third)

    def test_is_counted_with_the_largest_particles_branch(self):
        """The quickest particle sets m / K, the one of the largest Re the exponent."""
        spheres = [
            {"radius": 1e-4, "position": [-0.01, 0.0, 0.0]},
            {"radius": 3e-3, "position": [0.01, 0.0, 0.0]},
        ]
        slip = 2e-3  # Re = 0.8 and 24
        found = plan({"spheres": spheres, "drag.scheme": "held"}, slip)
        assert found.interval_s == pytest.approx(0.1 / 1.354 * relaxation(slip, 1e-4), rel=1e-12)

    @pytest.mark.parametrize("scheme", ["held", "implicit"])
    def test_no_particle_crosses_more_than_its_radius_at_an_entrance(self, scheme):
        case = case_of(INFILTRATION)
        smallest = float(case.population.particle_radii_m.min())
        # Of low density the particles relax long before they cross anything, of high long after.
        changes = {"drag.scheme": scheme, "time.duration": 1e6, "particles.density": 7e6}
        slip = 0.01
        found = plan(changes, slip, tables=INFILTRATION)
        assert found.interval_s == pytest.approx(smallest / slip, rel=1e-12)
        light = plan({**changes, "particles.density": 7000.0}, slip, tables=INFILTRATION)
        assert light.interval_s < 0.5 * found.interval_s
        # A box has no entrance.
        box = plan({"drag.scheme": scheme, "particles.density": 7e6}, slip)
        assert box.interval_s > 10 * RADIUS / slip

    def test_where_nothing_is_out_of_date_but_at_an_entrance(self):
        """Below Re = 1 a crossing is what is left of the implicit scheme's reasons."""
        changes = {"drag.scheme": "implicit", "time.duration": 1e9}
        smallest = float(case_of(INFILTRATION).population.particle_radii_m.min())
        found = plan(changes, 1e-4, tables=INFILTRATION)
        assert found.interval_s == pytest.approx(smallest / 1e-4, rel=1e-12)

    @pytest.mark.parametrize("scheme", ["held", "implicit", "exact"])
    def test_never_exceeds_that_of_the_samples(self, scheme):
        changes = {"drag.scheme": scheme, "time.duration": 0.1}
        assert plan(changes).interval_s == pytest.approx(0.01, rel=1e-12)
        assert plan({**changes, "drag.refresh": 0.02}).interval_s == pytest.approx(0.01, rel=1e-12)
        # Nothing is kept by the exact scheme.
        shortest = 0.01 if scheme == "exact" else 0.004
        asked = {**changes, "drag.refresh": 0.004}
        assert plan(asked).interval_s == pytest.approx(shortest, rel=1e-12)

    @pytest.mark.parametrize("scheme", ["held", "implicit"])
    @pytest.mark.parametrize("slip", [1e-4, 1e-2])
    def test_is_as_asked_for_whatever_the_tolerance(self, scheme, slip):
        changes = {"drag.scheme": scheme, "drag.refresh": 0.123, "drag.tolerance": 1e-5}
        assert plan(changes, slip).interval_s == 0.123


class TestAuto:
    def test_holds_forces_that_may_be_kept_for_twenty_steps(self):
        interval = plan({"drag.scheme": "held"}).interval_s
        assert plan(step=interval / 20.001).scheme == "held"
        assert plan(step=interval / 19.999).scheme == "implicit"
        assert plan(step=interval / 20.001).interval_s == interval

    def test_counts_the_interval_that_is_asked_for(self):
        assert plan({"drag.refresh": 0.1}, step=0.0049).scheme == "held"
        assert plan({"drag.refresh": 0.1}, step=0.0051).scheme == "implicit"

    def test_holds_no_force_for_longer_than_is_stable(self):
        longest = LONGEST_KEPT * relaxation(0.01)
        below = plan({"drag.refresh": 0.999 * longest})
        above = plan({"drag.refresh": 1.001 * longest})
        assert (below.scheme, above.scheme) == ("held", "implicit")
        assert above.interval_s == 1.001 * longest

    def test_a_loose_tolerance_goes_no_further_than_is_stable(self):
        # sqrt(2 x 0.1) / 1.354 = 0.33 of m / K is more than a held force may be kept.
        found = plan({"drag.tolerance": 0.1})
        assert found.scheme == "held"
        assert found.interval_s == pytest.approx(LONGEST_KEPT * relaxation(0.01), rel=1e-12)

    @pytest.mark.parametrize("step", [SHORT, 1e3])
    def test_without_the_coupling_forces_are_held(self, step):
        assert plan({"drag.carrier": "addforce"}, step=step).scheme == "held"

    def test_without_the_coupling_too_long_is_refused(self):
        longest = LONGEST_KEPT * relaxation(0.01)
        with pytest.raises(SceneError, match=r"drag\.refresh"):
            plan({"drag.carrier": "addforce", "drag.refresh": 1.001 * longest})

    @pytest.mark.parametrize("scheme", ["exact", "held", "implicit"])
    @pytest.mark.parametrize("step", [SHORT, 1e3])
    def test_a_scheme_that_is_asked_for_is_taken(self, scheme, step):
        assert plan({"drag.scheme": scheme}, step=step).scheme == scheme

    def test_in_a_case(self):
        """Particles that relax slowly beside their contacts; and quickly, in a thick fluid."""
        slow, quick = case_of(INFILTRATION), case_of(INFILTRATION, {"fluid.viscosity": 10.0})
        assert slow.time.drag_scheme == "held"
        assert slow.time.refresh_every >= 20
        assert quick.time.drag_scheme == "implicit"
        assert case_of(COLLISION).time.drag_scheme == ""

    def test_in_a_case_with_a_step_of_its_own(self):
        free = case_of(INFILTRATION).time
        kept = free.refresh_every * free.step_s
        assert kept > 100 * free.step_s
        # Soft contacts would allow longer steps than this one.
        for step, scheme in [(kept / 25, "held"), (kept / 15, "implicit")]:
            changes = {"particles.youngs_modulus": 100.0, "time.step": step}
            assert case_of(INFILTRATION, changes).time.drag_scheme == scheme

    @given(st.floats(-4, 1), st.floats(-4, -0.1), st.floats(-4, 1), st.floats(-3, 1))
    @settings(deadline=None)
    def test_never_shortens_a_step_and_is_never_refused(self, modulus, tolerance, refresh, mu):
        """Auto only holds where the bound of the held scheme is far above the others."""
        changes = {
            "time.duration": 10.0,
            "particles.youngs_modulus": 1e6 * 10**modulus,
            "drag.tolerance": 10**tolerance,
            "drag.refresh": 10**refresh,
            "fluid.viscosity": 10**mu,
        }
        time = case_of(COLLISION, {"fluid": FLUID, "pressure.gradient": 10.0, **changes}).time
        assert time.bounds[0].name != "drag"
        assert time.drag_scheme in ("held", "implicit")
        if time.drag_scheme == "held":
            assert time.drag_resolved


class TestRefusal:
    """Held forces that would grow without bound."""

    @pytest.mark.parametrize("slip", [slip for slip, _ in SLIPS])
    def test_too_long_a_refresh(self, slip):
        longest = LONGEST_KEPT * relaxation(slip)
        changes = {"drag.scheme": "held", "drag.refresh": 1.001 * longest}
        with pytest.raises(SceneError) as caught:
            plan(changes, slip)
        text = str(caught.value)
        assert text.startswith(f"drag.refresh = {1.001 * longest:g} s: ")
        assert f"must be at most {longest:.4g} s" in text
        assert "shorten or remove drag.refresh" in text
        assert "drag.scheme = implicit" in text
        # What the message allows is accepted (it rounds to four digits), and so is its way out.
        allowed = float(text.split("must be at most ")[1].split()[0])
        assert plan({**changes, "drag.refresh": 0.999 * allowed}, slip).scheme == "held"
        assert plan({"drag.scheme": "held"}, slip).interval_s <= longest
        assert plan({**changes, "drag.scheme": "implicit"}, slip).scheme == "implicit"
        assert plan({**changes, "drag.scheme": "exact"}, slip).scheme == "exact"

    def test_of_a_case(self):
        changes = {"drag.scheme": "held", "time.duration": 1000.0}
        with pytest.raises(SceneError, match=r"drag\.refresh = 20 s: must be at most") as caught:
            case_of(INFILTRATION, {**changes, "drag.refresh": 20.0})
        allowed = float(str(caught.value).split("at most ")[1].split()[0])
        time = case_of(INFILTRATION, {**changes, "drag.refresh": 0.999 * allowed}).time
        assert time.refresh_every * time.step_s <= allowed
        assert time.drag_resolved

    def test_samples_may_be_what_keeps_it_short(self):
        changes = {"drag.scheme": "held", "drag.refresh": 1e3, "time.duration": 0.1}
        assert plan(changes).interval_s == pytest.approx(0.01, rel=1e-12)


@pytest.mark.parametrize("every", [1, 2, 3, 20, 500])
@pytest.mark.parametrize("power", sorted({branch.power for branch in BRANCHES}))
@pytest.mark.parametrize(("kept", "stable"), [(LONGEST_KEPT, True), (2.0, False)])
def test_what_may_be_held_dies_out_and_what_is_far_beyond_grows(every, power, kept, stable):
    """The held scheme as the engine steps it, linear about a steady slip; K follows slip^p."""
    rate = (1 + power) * kept / every  # per step
    ahead = (every + 1) / (2 * every)
    slip = last = 1.0
    old = 0.0
    largest = []
    for _ in range(200):
        new = -rate * ((1 + ahead) * slip - ahead * last)
        last = slip
        # Kicks of half the old and half the new force; the first of M is where they differ.
        slip += 0.5 * (old + new) + (every - 1) * new
        old = new
        largest.append(abs(slip))
        if largest[-1] > 1e6:
            break
    assert (largest[-1] < 1e-6) == stable
    assert (largest[-1] > 1e6) == (not stable)


def test_no_fluid_no_plan():
    scene = scene_of(LONE, {"fluid": GONE})
    assert plan_drag(scene, populate(scene, layout(scene)), 0.01, SHORT) is None


@pytest.mark.parametrize("scheme", ["auto", "exact", "held", "implicit"])
def test_without_particles_there_is_nothing_to_keep(scheme):
    grains = {"youngs_modulus": 1.0e6, "poissons_ratio": 0.25}
    found = plan({"spheres": [GRAIN], "grains": grains, "drag.scheme": scheme})
    assert found.interval_s == pytest.approx(SAMPLES, rel=1e-12)
    assert found.relaxation_s == np.inf
    assert found.scheme == ("implicit" if scheme == "auto" else scheme)
