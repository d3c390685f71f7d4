"""Orders of a study of accuracy: how errors grow with a knob, beside what is expected of it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from liggghts_driver.studies.exact import fitted_order

if TYPE_CHECKING:
    from collections.abc import Sequence

    from liggghts_driver.studies.accuracy import Judged


def orders(judged: Sequence[Judged], name: str) -> list[dict[str, Any]]:
    """Of each knob that is turned by numbers: the expected order, and the fitted one.

    Parameters
    ----------
    judged
        Every setting.
    name
        The quantity whose error goes with the step and with the drag's tolerance. Only errors that
        can be told from none are fitted. Of the stiffness it is the largest overlap, which is what
        softness gets wrong, and no difference of chaotic runs.

    Returns
    -------
    ``knob``, ``of``, ``expected``, ``measured`` (None where there is nothing to fit) and
    ``values``, how many the fit has.
    """
    knobs = dict.fromkeys(j.setting.knob for j in judged if j.setting.order is not None)
    return [_order([j for j in judged if j.setting.knob == knob], name) for knob in knobs]


def _order(own: Sequence[Judged], name: str) -> dict[str, Any]:
    turned = [j for j in own if math.isfinite(j.setting.value)]
    soft = own[0].setting.knob == "stiffness"
    if soft:
        points = [(j.setting.value, j.overlap_over_radius) for j in turned]
    else:
        told = [j for j in turned if name in j.errors and not j.is_below_noise(name)]
        points = [(j.setting.value, abs(j.errors[name].mean)) for j in told]
    return {
        "knob": own[0].setting.knob,
        "of": "largest overlap" if soft else f"error of {name}",
        "expected": own[0].setting.order,
        "measured": _slope(points),
        "values": len(points),
    }


def _slope(points: Sequence[tuple[float, float]]) -> float | None:
    """The exponent of a power law through points; None where there are too few."""
    known = [(x, y) for x, y in points if y > 0.0]
    slope = fitted_order([x for x, _ in known], [y for _, y in known])
    return None if math.isnan(slope) else slope
