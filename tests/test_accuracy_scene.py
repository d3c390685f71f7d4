"""A scene that asks for an accuracy: the settings that it comes to, and what is told of them."""

from __future__ import annotations

import json

import pytest
from accuracy_studies import REFERENCE, STEP, put, row, study_of
from hypothesis import given, settings
from hypothesis import strategies as st
from small_scenes import COLLISION, GONE, INFILTRATION, changed, scene_of

from liggghts_driver.accuracy import FINEST, accuracy_facts
from liggghts_driver.errors import SceneError
from liggghts_driver.identity import scene_hash
from liggghts_driver.prepare import prepare
from liggghts_driver.report.listing import scene_listing
from liggghts_driver.rundir import RunDirectory
from liggghts_driver.scene import Scene, make_scene, read_problem, read_scene
from liggghts_driver.solve import load, solve

SCENE = scene_of(INFILTRATION)
SOFT_SETTINGS = {
    "time.step_fraction": 0.2,
    "drag.tolerance": 0.001,
    "contact.stiffness_scale": 0.1,
    "contact.largest_overlap": 0.072,
}
IMPLICIT = {"drag.scheme": "implicit", "drag.refresh": 0.002}


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    """A working folder with a study of the small infiltration."""
    monkeypatch.chdir(tmp_path)
    put(study_of(SCENE), tmp_path / "runs/study/accuracy.json")
    return tmp_path


def asking(accuracy, changes=None) -> Scene:
    return scene_of(INFILTRATION, {"accuracy": accuracy, **(changes or {})})


def mistake(tables, changes) -> str:
    with pytest.raises(SceneError) as caught:
        scene_of(tables, changes)
    return str(caught.value)


class TestSettings:
    @pytest.mark.parametrize(
        ("accuracy", "wanted"),
        [
            ("draft", SOFT_SETTINGS),
            ("standard", {**FINEST, "time.step_fraction": 0.2}),
            ("reference", FINEST),
            (0.081, SOFT_SETTINGS),
            (0.02, FINEST),
        ],
    )
    def test_the_same_run_as_with_the_settings_written_out(self, accuracy, wanted):
        scene, written = asking(accuracy), scene_of(INFILTRATION, wanted)
        assert scene.model_copy(update={"accuracy": None}) == written
        assert scene_hash(scene) == scene_hash(written)
        assert scene_listing(scene) == scene_listing(written)

    def test_a_scene_without_the_key_is_known_as_before_there_was_one(self):
        """By the version before: runs on disk are found again."""
        assert scene_hash(scene_of(COLLISION)).startswith("b489653de911729a")
        assert scene_hash(SCENE).startswith("04b62a043afafc95")

    def test_the_reference_needs_no_study(self, place):
        (place / "runs/study/accuracy.json").unlink()
        assert asking("reference").time.step_fraction == 0.05
        assert scene_of(COLLISION, {"accuracy": "reference"}).time.step_fraction == 0.05

    def test_a_setting_of_another_scheme(self, place):
        other = row("drag", IMPLICIT, 0.2, 0.0, 0.01)
        put(study_of(SCENE, REFERENCE, other), place / "runs/study/accuracy.json")
        scene = asking("standard")
        assert (scene.drag.scheme, scene.drag.refresh) == ("implicit", 0.002)
        assert accuracy_facts(scene)["overruled"] == []

    def test_tables_that_are_models_will_do(self):
        tables = {name: getattr(SCENE, name) for name in SCENE.model_fields_set}
        assert make_scene({**tables, "accuracy": "draft"}) == asking("draft")


class TestExplicit:
    @pytest.mark.parametrize(
        ("given", "kept"),
        [
            ({"time.step_fraction": 0.1}, ["time.step_fraction"]),
            ({"time.step": 1e-5}, ["time.step"]),
            ({"time.step": 1e-5, "time.step_fraction": 0.3}, ["time.step"]),
            ({"drag.tolerance": 0.005}, ["drag.tolerance"]),  # the default, and yet explicit
            ({"drag.refresh": 1e-4}, ["drag.refresh"]),
            ({"contact.stiffness_scale": 1.0}, ["contact.stiffness_scale"]),
            (
                {"contact.stiffness_scale": 0.5, "time.step": 1e-5},
                ["time.step", "contact.stiffness_scale"],
            ),
        ],
        ids=str,
    )
    def test_it_wins_and_the_error_is_not_known(self, given, kept):
        scene = asking("draft", given)
        for name, value in given.items():
            table, key = name.split(".")
            assert getattr(getattr(scene, table), key) == value
        facts = accuracy_facts(scene)
        assert facts["overruled"] == kept
        assert facts["expected_error"] is facts["expected_reach"] is None
        assert not {*given} & {*facts["settings"]}
        sentence = facts["sentences"][0]
        assert f"explicit {' and '.join(kept)} kept" in sentence
        assert "which error is to be expected is not known" in sentence
        assert "within" not in sentence
        # What was not given is taken.
        assert scene.contact.largest_overlap == 0.072

    def test_a_step_that_is_given_is_not_bounded_by_the_settings(self):
        """A tenth of a contact, as without an accuracy, though the finest is a twentieth."""
        scene = asking("reference", {"time.step": 1e-5})
        assert scene.time.step_fraction == SCENE.time.step_fraction

    def test_the_same_value_overrules_nothing(self):
        facts = accuracy_facts(asking("draft", {"time.step_fraction": 0.2}))
        assert facts["overruled"] == []
        assert facts["expected_reach"] == pytest.approx(0.08)

    def test_a_limit_that_is_given_stays_and_changes_no_error(self):
        scene = asking("draft", {"contact.largest_overlap": 0.02})
        assert scene.contact.largest_overlap == 0.02
        facts = accuracy_facts(scene)
        assert facts["overruled"] == ["contact.largest_overlap"]
        assert facts["expected_reach"] == pytest.approx(0.08)
        assert "contact.largest_overlap is explicitly 0.02" in facts["sentences"][1]

    def test_a_tolerance_that_is_given_overrules_an_interval(self, place):
        other = row("drag", IMPLICIT, 0.2, 0.0, 0.01)
        put(study_of(SCENE, REFERENCE, other), place / "runs/study/accuracy.json")
        scene = asking("standard", {"drag.tolerance": 0.001})
        assert (scene.drag.refresh, scene.drag.tolerance) == (None, 0.001)
        assert accuracy_facts(scene)["overruled"] == ["drag.tolerance"]

    def test_an_override_is_explicit_too(self, place):
        path = place / "scene.json"
        path.write_text(json.dumps(changed(INFILTRATION, {"accuracy": "draft"})))
        assert accuracy_facts(read_scene(path))["overruled"] == []
        scene = read_scene(path, ["time.step_fraction=0.1"])
        assert accuracy_facts(scene)["overruled"] == ["time.step_fraction"]


class TestWords:
    def test_what_is_to_be_expected_and_how_that_is_known(self):
        facts = accuracy_facts(asking("standard"))
        (sentence,) = facts["sentences"]
        assert sentence == (
            "accuracy standard: step_fraction 0.2: flow within 3.1 % (95 %) of the finest "
            "settings, measured with 8 packings over 10 s by liggghts-driver study accuracy "
            "'small scene.toml' (runs/study/accuracy.json)"
        )
        assert (facts["level"], facts["tolerance"]) == ("standard", 0.05)
        assert facts["expected_error"] == 0.011
        assert facts["expected_reach"] == pytest.approx(0.031)
        assert facts["settings"] == {**FINEST, "time.step_fraction": 0.2}
        assert facts["study"]["title"] == "A made-up study"
        assert facts["study"]["file"] == "runs/study/accuracy.json"
        assert facts["study"]["cost_over_reference"] == 0.3

    def test_a_limit_that_was_moved_is_told(self):
        sentences = accuracy_facts(asking("draft"))["sentences"]
        assert sentences[1] == (
            "contacts of these settings overlapped by up to 4.8 % of a radius in the study, "
            "contact.largest_overlap is therefore 0.072"
        )

    def test_nothing_cheaper_was_within(self):
        facts = accuracy_facts(asking(0.02))
        assert (
            "accuracy 0.02: the finest settings, nothing cheaper was within 2 %, measured"
            in (facts["sentences"][0])
        )
        assert (facts["level"], facts["expected_reach"]) == (None, 0.0)

    def test_the_reference(self):
        facts = accuracy_facts(asking("reference"))
        assert facts["sentences"] == [
            "accuracy reference: the finest settings, which studies of accuracy hold others against"
        ]
        assert (facts["expected_error"], facts["study"]) == (0.0, {})

    def test_one_packing_and_a_study_without_its_command(self, place):
        alone = row("reference", {}, 1.0, 0.0, None, replicates=1)
        made_by = {"command": [], "liggghts_driver": "0.1.0"}
        study = study_of(SCENE, alone, provenance=made_by)
        put(study, place / "runs/study/accuracy.json")
        sentence = accuracy_facts(asking("draft"))["sentences"][0]
        assert "with 1 packing over 10 s by a study of accuracy (runs/" in sentence

    def test_nothing_is_said_where_nothing_was_asked(self):
        assert accuracy_facts(SCENE) == {}


class TestMistakes:
    def test_a_study_is_missing(self, place):
        (place / "runs/study/accuracy.json").unlink()
        path = place / "my scene.json"
        path.write_text(json.dumps(INFILTRATION))
        with pytest.raises(SceneError) as caught:
            read_scene(path, ["pressure.gradient=5", "accuracy=draft", "seed=2"])
        text = str(caught.value)
        assert text.startswith("my scene.json: 1 mistake\n  - accuracy = 'draft': no study")
        command = f"study accuracy '{path}' --set pressure.gradient=5 --set seed=2`"
        assert f"run `liggghts-driver {command}" in text
        assert '"reference"' in text

    def test_of_another_problem(self):
        text = mistake(INFILTRATION, {"accuracy": 0.05, "pressure.gradient": 5.0})
        assert "accuracy = 0.05: no study" in text
        assert "study accuracy SCENE`" in text

    def test_the_study_has_no_reference_and_nothing_within(self, place):
        put(study_of(SCENE, STEP), place / "runs/study/accuracy.json")
        assert "no study" in mistake(INFILTRATION, {"accuracy": 0.01})

    def test_a_scene_that_no_study_can_study(self):
        text = mistake(COLLISION, {"accuracy": "draft"})
        assert "there is no [specimen]" in text
        assert "study accuracy" not in text

    @pytest.mark.parametrize(
        "accuracy",
        ["sloppy", 0.0, 1.0, -0.1, 5, float("nan"), True, [], {}, {"level": "draft"}],
        ids=str,
    )
    def test_what_is_no_accuracy(self, accuracy):
        text = mistake(INFILTRATION, {"accuracy": accuracy, "particles.count": GONE})
        assert "must be draft, standard, reference, or a relative error above 0" in text
        # A contradiction elsewhere is told with it.
        assert "particles.count, particles.volume_fraction" in text

    @pytest.mark.parametrize(
        ("record", "words"),
        [
            ({"level": "draft", "settings": {"seed": 1.0}}, "seed is no setting"),
            ({"settings": {}}, "must have a level or a tolerance"),
            ({"level": "draft", "tolerance": 0.1, "settings": {}}, "a level or a tolerance"),
            ({"level": "draft", "settings": {}, "study": {}}, "accuracy.study.file (missing)"),
        ],
        ids=str,
    )
    def test_a_record_that_is_none(self, record, words):
        assert words in mistake(INFILTRATION, {"accuracy": record})

    trees = st.recursive(
        st.none() | st.booleans() | st.floats() | st.text(max_size=4) | st.just("draft"),
        lambda inner: (
            st.lists(inner, max_size=2)
            | st.dictionaries(st.sampled_from(["level", "tolerance", "settings", "study"]), inner)
        ),
        max_leaves=6,
    )

    @given(trees)
    @settings(deadline=None)
    def test_anything_gives_a_scene_or_a_mistake(self, accuracy):
        try:
            scene = asking(accuracy)
        except SceneError:
            return
        assert scene.accuracy is None or scene.accuracy.is_settled


class TestRecord:
    @pytest.mark.parametrize("accuracy", ["draft", 0.05, "reference"])
    @pytest.mark.parametrize("given", [{}, {"time.step": 1e-5}, {"drag.refresh": 1e-4}], ids=str)
    def test_a_run_keeps_it_whatever_is_studied_later(self, place, accuracy, given):
        scene = asking(accuracy, given)
        run = RunDirectory(place / "run")
        run.write_scene(scene)
        (place / "runs/study/accuracy.json").unlink()
        again = run.read_scene()
        assert again == scene
        assert accuracy_facts(again) == accuracy_facts(scene)
        assert hash(again) == hash(scene)

    def test_a_setting_that_is_changed_in_a_runs_scene_is_told(self, place):
        run = RunDirectory(place / "run")
        run.write_scene(asking("draft"))
        scene = read_scene(run.scene, ["contact.stiffness_scale=0.5"])
        facts = accuracy_facts(scene)
        assert facts["overruled"] == ["contact.stiffness_scale"]
        assert facts["expected_reach"] is None

    def test_so_is_a_problem(self, place):
        run = RunDirectory(place / "run")
        run.write_scene(asking("draft"))
        facts = accuracy_facts(read_scene(run.scene, ["pressure.gradient=5"]))
        assert facts["expected_reach"] is None
        assert (
            "that was another problem; which error is to be expected is not"
            in (facts["sentences"][0])
        )

    def test_a_screened_scene_keeps_it(self):
        faint = {"gravity": {"acceleration": [0.0, 0.0, -1e-9]}, "effects.screen": 0.01}
        asked = asking("reference", faint)
        case = prepare(asked)
        assert case.screened
        assert accuracy_facts(case.identity) == accuracy_facts(asked)

    def test_a_study_of_accuracy_begins_without_it(self, place):
        path = place / "scene.json"
        path.write_text(json.dumps(changed(INFILTRATION, {"accuracy": "nonsense"})))
        assert read_problem(path) == SCENE
        assert read_problem(path, ["accuracy=draft", "seed=2"]) == scene_of(
            INFILTRATION, {"seed": 2}
        )


class TestRun:
    def test_results_and_report(self, place, engine):
        solution = solve(asking("draft"), place / "run")
        stored = json.loads((place / "run/results.json").read_text())["accuracy"]
        assert stored == accuracy_facts(asking("draft"))
        page = (place / "run/report.html").read_text()
        assert "Accuracy draft: step_fraction 0.2, stiffness_scale 0.1: flow within 8 %" in page
        assert "Contacts of these settings overlapped by up to 4.8 %" in page
        (place / "runs/study/accuracy.json").unlink()
        assert load(place / "run").results["accuracy"] == solution.results["accuracy"]

    def test_without_it_nothing_is_told(self, place, engine):
        assert solve(SCENE, place / "run").results["accuracy"] == {}
        assert "ccuracy" not in (place / "run/report.html").read_text().partition("<body>")[2]

    def test_a_finished_run_is_found_again_and_says_who_asked_last(self, place, engine):
        written = scene_of(INFILTRATION, SOFT_SETTINGS)
        assert not solve(written, place / "run").reused
        for scene in (asking("draft"), asking(0.08000001), written):
            solution = solve(scene, place / "run")
            assert solution.reused
            assert solution.results["accuracy"] == accuracy_facts(scene)
            assert load(place / "run").results["accuracy"] == accuracy_facts(scene)
