"""What is to be said of the accuracy that a scene asked for: numbers, and sentences."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING, Any

from liggghts_driver.accuracy.problem import is_of_another_problem
from liggghts_driver.accuracy.settings import OVERLAP, overruled, value_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from liggghts_driver.scene.accuracy import Accuracy, Studied
    from liggghts_driver.scene.model import Scene


def accuracy_facts(scene: Scene) -> dict[str, Any]:
    """The accuracy of a scene as ``results.json`` has it; empty where none was asked for.

    ``expected_error`` and ``expected_reach``, relative to the finest settings, are None where they
    are not known: a setting was overruled, or the scene has become another problem.
    """
    accuracy = scene.accuracy
    if accuracy is None or accuracy.settings is None:
        return {}
    study, known = accuracy.study, _is_known(accuracy, scene)
    reference = 0.0 if known else None
    return {
        "level": accuracy.level,
        "tolerance": accuracy.tolerated,
        "settings": {n: v for n, v in accuracy.settings.items() if value_of(scene, n) == v},
        "overruled": list(overruled(accuracy.settings, scene)),
        "expected_error": study.error if study and known else reference,
        "expected_reach": study.reach if study and known else reference,
        "study": study.model_dump(mode="json") if study else {},
        "sentences": list(_sentences(accuracy, scene)),
    }


def _is_known(accuracy: Accuracy, scene: Scene) -> bool:
    """Whether the scene is computed by the settings that were studied, and is that problem."""
    assert accuracy.settings is not None
    kept = set(overruled(accuracy.settings, scene)) - {OVERLAP}  # which changes no motion
    return not kept and not is_of_another_problem(scene)


def _sentences(accuracy: Accuracy, scene: Scene) -> Iterator[str]:
    assert accuracy.settings is not None
    yield f"accuracy {accuracy.asked}: {'; '.join(_parts(accuracy, scene))}"
    if accuracy.study is not None and OVERLAP in accuracy.settings:
        kept = OVERLAP in overruled(accuracy.settings, scene)
        yield (
            f"contacts of these settings overlapped by up to {_percent(accuracy.study.overlap)} of "
            f"a radius in the study, {OVERLAP} is {'explicitly' if kept else 'therefore'} "
            f"{value_of(scene, OVERLAP):g}"
        )


def _parts(accuracy: Accuracy, scene: Scene) -> Iterator[str]:
    """What was chosen and why, how that is known, and what the scene has otherwise."""
    assert accuracy.settings is not None
    known = _is_known(accuracy, scene)
    yield _chosen(accuracy, known=known)
    if is_of_another_problem(scene):
        yield "that was another problem"
    kept = overruled(accuracy.settings, scene)
    if kept:
        yield f"explicit {' and '.join(kept)} kept"
    if not known:
        yield "which error is to be expected is not known"


def _chosen(accuracy: Accuracy, *, known: bool) -> str:
    study = accuracy.study
    if study is None:
        return "the finest settings, which studies of accuracy hold others against"
    if study.finest:
        within = _percent(accuracy.tolerated or 0.0)
        return f"the finest settings, nothing cheaper was within {within}{_measured(study)}"
    reach = f": flow within {_percent(study.reach)} (95 %) of the finest settings" if known else ""
    return f"{study.setting}{reach}{_measured(study)}"


def _measured(study: Studied) -> str:
    """How it is known."""
    packings = "1 packing" if study.replicates == 1 else f"{study.replicates} packings"
    return (
        f", measured with {packings} over {study.duration_s:g} s by {_command(study)} "
        f"({study.file})"
    )


def _command(study: Studied) -> str:
    words = study.command[1:]
    return shlex.join(["liggghts-driver", *words]) if words else "a study of accuracy"


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %"
