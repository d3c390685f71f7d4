"""Axes of a sweep: the values they make, and what is wrong with them."""

from __future__ import annotations

import itertools
import json
import math

import numpy as np
import pytest
from small_scenes import INFILTRATION

from liggghts_driver.errors import SweepError
from liggghts_driver.sweeps.plan import make_plan


@pytest.fixture
def plan_of(tmp_path):
    """What makes the plan of a sweep over forty particles, from the text after the scene."""
    (tmp_path / "scene.json").write_text(json.dumps(INFILTRATION))

    def plan(text: str, *overrides: str):
        path = tmp_path / "sweep.toml"
        path.write_text(f'scene = "scene.json"\n{text}')
        return make_plan(path, overrides)

    return plan


@pytest.fixture
def mistakes_of(plan_of):
    """The mistakes of a sweep, a line each."""

    def mistakes(text: str, *overrides: str) -> list[str]:
        with pytest.raises(SweepError) as caught:
            plan_of(text, *overrides)
        assert caught.value.exit_code == 2
        head, *lines = str(caught.value).splitlines()
        assert head == f"sweep.toml: {len(lines)} mistake{'s' if len(lines) > 1 else ''}"
        return [line.removeprefix("  - ") for line in lines]

    return mistakes


def values_of(plan, name: str) -> list:
    return [point.values[name] for point in plan.points]


def test_axes_multiply_and_the_last_varies_fastest(plan_of):
    plan = plan_of(
        '[[axes]]\nkey = "pressure.gradient"\nvalues = [1, 2.5]\n'
        '[[axes]]\nkey = "contact.friction"\nvalues = [0.0, 0.1, 0.2]\n'
    )
    assert plan.axes == ("pressure.gradient", "contact.friction")
    assert [tuple(point.values.values()) for point in plan.points] == list(
        itertools.product([1, 2.5], [0.0, 0.1, 0.2])
    )
    assert [point.index for point in plan.points] == list(range(6))


def test_a_range_is_evenly_spaced_with_both_ends_and_without_rounding_dust(plan_of):
    plan = plan_of('[[axes]]\nkey = "contact.friction"\nfrom = 0.1\nto = 0.4\ncount = 4\n')
    assert values_of(plan, "contact.friction") == [0.1, 0.2, 0.3, 0.4]


def test_a_range_may_fall_and_be_even_in_its_ratios(plan_of):
    plan = plan_of(
        '[[axes]]\nkey = "pressure.gradient"\nfrom = 100\nto = 0.1\ncount = 4\nscale = "log"\n'
    )
    assert values_of(plan, "pressure.gradient") == [100.0, 10.0, 1.0, 0.1]


def test_a_range_of_a_whole_number_is_whole(plan_of):
    plan = plan_of(
        '[[axes]]\nkey = "particles.count"\nfrom = 10\nto = 100\ncount = 3\nscale = "log"\n'
    )
    counts = values_of(plan, "particles.count")
    assert counts == [10, 32, 100]  # 31.6 rounded
    assert all(type(count) is int for count in counts)
    assert plan.scene(plan.points[1]).particles.count == 32


def test_keys_that_vary_together_have_one_row_for_each_combination(plan_of):
    plan = plan_of(
        '[[axes]]\nkeys = ["pressure.gradient", "drag.scheme"]\n'
        'values = [[1.0, "held"], [2.0, "implicit"]]\n'
    )
    assert [dict(point.values) for point in plan.points] == [
        {"pressure.gradient": 1.0, "drag.scheme": "held"},
        {"pressure.gradient": 2.0, "drag.scheme": "implicit"},
    ]
    assert [plan.scene(point).drag.scheme for point in plan.points] == ["held", "implicit"]


def test_a_sphere_of_the_list_and_a_whole_vector_vary_too(plan_of):
    plan = plan_of(
        "set.spheres = [{ radius = 0.001, position = [-0.01, 0, 0] }]\n"
        '[[axes]]\nkey = "spheres[0].radius"\nvalues = [0.001, 0.002]\n'
        '[[axes]]\nkey = "gravity.acceleration"\nvalues = [[0, 0, -9.81], [-1, 0, 0]]\n'
    )
    scenes = [plan.scene(point) for point in plan.points]
    assert [scene.spheres[0].radius for scene in scenes] == [0.001, 0.001, 0.002, 0.002]
    assert scenes[1].gravity.acceleration == (-1.0, 0.0, 0.0)
    assert "gravity" not in plan.base  # what varies leaves the base as it is


SAMPLE = """
root_seed = 5
[[axes]]
sample = "{how}"
count = {count}
[axes.ranges]
pressure.gradient = [2.0, 8.0]
contact.friction = [0.001, 1.0]
particles.count = [11, 30]
[axes.scale]
contact.friction = "log"
"""


@pytest.mark.parametrize("how", ["latin-hypercube", "sobol"])
def test_a_sample_has_one_point_in_each_of_as_many_layers_of_every_key(plan_of, how):
    plan = plan_of(SAMPLE.format(how=how, count=16))
    gradients = np.array(values_of(plan, "pressure.gradient"))
    frictions = np.array(values_of(plan, "contact.friction"))
    counts = values_of(plan, "particles.count")
    layers = [(gradients - 2.0) / 6.0, np.log10(frictions) / 3.0 + 1.0]
    for shares in layers:
        assert sorted(np.floor(16 * shares).astype(int)) == list(range(16))
    assert all(type(count) is int and 11 <= count <= 30 for count in counts)
    assert min(counts) < 13  # both from the outermost of 16 layers, 19 / 16 wide
    assert max(counts) > 28


def test_a_sobol_sample_grows_by_points_between(plan_of):
    some = plan_of(SAMPLE.format(how="sobol", count=8))
    more = plan_of(SAMPLE.format(how="sobol", count=16))
    assert [point.run for point in more.points[:8]] == [point.run for point in some.points]


@pytest.mark.parametrize("how", ["latin-hypercube", "sobol"])
def test_a_sample_follows_from_its_seed_and_from_nothing_else(plan_of, how):
    text = SAMPLE.format(how=how, count=8)
    first = values_of(plan_of(text), "pressure.gradient")
    assert values_of(plan_of(text), "pressure.gradient") == first
    assert values_of(plan_of(f"replicates = 2\n{text}"), "pressure.gradient")[:8] == first
    other = text.replace("root_seed = 5", "root_seed = 6")
    assert values_of(plan_of(other), "pressure.gradient") != first


def test_two_samples_are_independent(plan_of):
    text = '[[axes]]\nsample = "sobol"\ncount = 4\nranges = {{ "{}" = [0.0, 1.0] }}\n'
    plan = plan_of(text.format("contact.friction") + text.format("pressure.gradient"))
    shares = [set(values_of(plan, name)) for name in plan.axes]
    assert [len(each) for each in shares] == [4, 4]
    assert not shares[0] & shares[1]


AXIS = '[[axes]]\nkey = "pressure.gradient"\n'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[[axes]]\n", ["axes[0].key (missing)", "a list has key, values"]),
        (AXIS, ["axes[0].values (missing)"]),
        (AXIS + "values = []", ["axes[0].values = []: no points"]),
        (AXIS + "from = 1\nto = 2", ["axes[0].count (missing): a range has key, from, to, count"]),
        (AXIS + "values = [1]\nfrom = 1", ["axes[0].from = 1.0: belongs to another form"]),
        (AXIS + "from = 1\nto = 2\ncount = 0", ["axes[0].count = 0", "greater than or equal to 1"]),
        (AXIS + 'from = 0\nto = 2\ncount = 3\nscale = "log"', ["axes[0].from = 0.0: a log scale"]),
        (AXIS + 'from = 1\nto = 2\ncount = 3\nscale = "cubic"', ["axes[0].scale", "'linear'"]),
        (AXIS + "valeus = [1]", ["axes[0].valeus", "did you mean values?", "valid: count, from"]),
        ('[[axes]]\nkey = "pressure..gradient"\nvalues = [1]', ["must be a key of the scene"]),
        ('[[axes]]\nkey = "fluid.density.x"\nvalues = [1]', ["density is not a table"]),
        ('[[axes]]\nkey = "spheres[0].radius"\nvalues = [1]', ["spheres[0] is not a table"]),
        ('[[axes]]\nkey = "presure.gradient"\nvalues = [1]', ["did you mean pressure?"]),
        ("[[axes]]\nkeys = []\nvalues = [[]]", ["axes[0].keys = []: nothing varies"]),
        (
            '[[axes]]\nkeys = ["seed", "contact.friction"]\nvalues = [[1, 0.1], [2]]',
            ["axes[0].values[1] = [2]: a row has one value for each of the 2 keys"],
        ),
        (
            '[[axes]]\nsample = "sobol"\ncount = 12\nranges.contact.friction = [0, 1]',
            ["axes[0].count = 12", "give 8 or 16"],
        ),
        (
            '[[axes]]\nsample = "sobol"\ncount = 8\nranges.contact.friction = [1, 0]',
            ["axes[0].ranges.contact.friction = [1.0, 0.0]: the first number must be below"],
        ),
        (
            '[[axes]]\nsample = "sobol"\ncount = 8\nscale = "log"\nranges.seed = [0, 1]',
            ["axes[0].ranges.seed = [0.0, 1.0]: a log scale"],
        ),
        (
            '[[axes]]\nsample = "random"\ncount = 8\nranges.contact.friction = [0, 1]',
            ["axes[0].sample = 'random'", "'latin-hypercube' or 'sobol'"],
        ),
        (
            '[[axes]]\nsample = "sobol"\ncount = 8\nscale.seed = "log"\nranges.title = [0, 1]',
            ["axes[0].scale = 'seed': does not vary on this axis"],
        ),
        (AXIS + "values = [1]\n" + AXIS + "values = [2]", ["stands on axes[0] and on axes[1]"]),
        (
            AXIS + 'values = [1]\n[[axes]]\nkey = "pressure"\nvalues = [{ gradient = 1 }]',
            ["pressure.gradient, pressure = 'given twice'"],
        ),
        ("set.pressure.gradient = 3\n" + AXIS + "values = [1]", ["on axes[0] and in [set]"]),
        ('replicates = 2\n[[axes]]\nkey = "seed"\nvalues = [1]', ["seed = 'an axis'"]),
        ("root_seed = 2\nset.seed = 3", ["seed = 'given twice'", "in [set]"]),
        ('[[axes]]\nkey = "resources.pack"\nvalues = [1]', ["axes[0] = 'resources.pack'"]),
        (
            AXIS + "from = 1\nto = 2\ncount = 1001\n"
            '[[axes]]\nkey = "contact.friction"\nfrom = 0\nto = 1\ncount = 1000',
            ["axes = '1001000 points': must be at most 1000000"],
        ),
        ("replicates = 1000000000", ["axes = '1000000000 points'"]),
    ],
)
def test_a_mistake_is_told_once_with_what_to_do(mistakes_of, text, words):
    lines = mistakes_of(text)
    assert any(all(word in line for word in words) for line in lines), lines
    assert len(lines) == (2 if text == "[[axes]]\n" else 1)


def test_an_override_of_what_varies_is_a_mistake(mistakes_of):
    (line,) = mistakes_of(AXIS + "values = [1]", "pressure . gradient = 3")
    assert "stands on axes[0] and in --set" in line


def test_values_are_finite_after_any_spread(plan_of):
    plan = plan_of(
        '[[axes]]\nkey = "particles.youngs_modulus"\nfrom = 1e5\nto = 1e12\ncount = 50\n'
        'scale = "log"\n'
    )
    moduli = values_of(plan, "particles.youngs_modulus")
    ratios = [b / a for a, b in itertools.pairwise(moduli)]
    # Twelve digits are kept of a value.
    assert ratios == pytest.approx([math.exp(math.log(1e7) / 49)] * 49, rel=1e-11)
