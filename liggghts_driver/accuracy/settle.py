"""The accuracy that a scene asks for, settled: its settings written out, and why these."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from liggghts_driver.accuracy.choice import choose
from liggghts_driver.accuracy.lookup import find_study
from liggghts_driver.accuracy.problem import problem_sha256
from liggghts_driver.accuracy.settings import FINEST, rivals
from liggghts_driver.scene.checks import Mistake
from liggghts_driver.scene.read import set_key

if TYPE_CHECKING:
    from collections.abc import Mapping

    from liggghts_driver.accuracy.choice import Choice
    from liggghts_driver.accuracy.lookup import Found
    from liggghts_driver.scene.accuracy import Accuracy
    from liggghts_driver.scene.model import Scene


def settle(scene: Scene, arguments: str) -> dict[str, Any] | Mistake:
    """A scene's tables with the settings that its accuracy comes to; those that it gives are kept.

    Parameters
    ----------
    scene
        A scene that asks for an accuracy. What its file gave is what was set when it was made.
    arguments
        What the command line calls the scene, with its overrides.

    Returns
    -------
    dict[str, Any] | Mistake
        The tables; or what is wrong, where no study of this problem is to be found.
    """
    assert scene.accuracy is not None
    tolerance = scene.accuracy.tolerated
    if tolerance is None:
        return _written_out(scene, FINEST, None)
    found = find_study(problem_sha256(scene))
    choice = None if found is None else choose(found.study, tolerance)
    if found is None or choice is None:
        return _unstudied(scene, scene.accuracy, arguments)
    settings = choice.settings_for(scene.contact.largest_overlap)
    return _written_out(scene, settings, _record(found, choice))


def _unstudied(scene: Scene, accuracy: Accuracy, arguments: str) -> Mistake:
    asked = accuracy.level or accuracy.tolerance
    bound = "no study tells what errors the settings of this problem make"
    if scene.specimen is None:
        fix = 'studies compare flow rates, and there is no [specimen]; use "reference"'
    else:
        fix = f'run `liggghts-driver study accuracy {arguments}` first, or use "reference"'
    return Mistake("accuracy", asked, bound, fix)


def _record(found: Found, choice: Choice) -> dict[str, Any]:
    study = found.study
    return {
        "file": found.file,
        "title": study.title,
        "command": study.provenance.command,
        "problem_sha256": study.problem_sha256,
        "duration_s": study.duration_s,
        "replicates": choice.replicates,
        "setting": choice.title,
        "finest": choice.finest,
        "error": choice.error,
        "reach": choice.reach,
        "overlap": choice.overlap,
        "cost_over_reference": choice.cost_over_reference,
    }


def _written_out(
    scene: Scene, settings: Mapping[str, Any], record: dict[str, Any] | None
) -> dict[str, Any]:
    given = scene.model_dump(mode="json", exclude_unset=True, exclude_none=True)
    tables = scene.model_dump(mode="json", exclude_unset=True, exclude_none=True)
    for name, value in settings.items():
        if not any(_has(given, rival) for rival in rivals(name)):
            set_key(tables, name, value)
    tables["accuracy"] |= {"settings": dict(settings), **({"study": record} if record else {})}
    return tables


def _has(tables: Mapping[str, Any], name: str) -> bool:
    table, key = name.split(".")
    return key in tables.get(table, {})
