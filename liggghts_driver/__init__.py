"""Turn a short scene description into a checked answer from the LIGGGHTS engine.

The whole of it in a notebook::

    from liggghts_driver import predict, read_scene, solve

    scene = read_scene("cases/infiltration_small.toml", ["pressure.gradient=5"])
    predict(scene).particle_flow_rate_m3_s          # Darcy's law, at once
    solution = solve(scene, "runs/five")            # the engine, checked
    solution.results["sections"]["entrance"]        # the answer
    solution.series                                 # the time series, a DataFrame

Names are loaded when they are first used, so that importing the package costs next to nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from liggghts_driver.errors import DriverError
    from liggghts_driver.explain import explain
    from liggghts_driver.prediction import predict, predict_gradient
    from liggghts_driver.resources import cases_dir
    from liggghts_driver.scene import Scene, make_scene, read_scene
    from liggghts_driver.solve import Solution, load, solve, write_only

__version__ = "0.1.0"

_HOMES = {
    "DriverError": "liggghts_driver.errors",
    "Scene": "liggghts_driver.scene",
    "Solution": "liggghts_driver.solve",
    "cases_dir": "liggghts_driver.resources",
    "explain": "liggghts_driver.explain",
    "load": "liggghts_driver.solve",
    "make_scene": "liggghts_driver.scene",
    "predict": "liggghts_driver.prediction",
    "predict_gradient": "liggghts_driver.prediction",
    "read_scene": "liggghts_driver.scene",
    "solve": "liggghts_driver.solve",
    "write_only": "liggghts_driver.solve",
}

__all__ = [
    "DriverError",
    "Scene",
    "Solution",
    "__version__",
    "cases_dir",
    "explain",
    "load",
    "make_scene",
    "predict",
    "predict_gradient",
    "read_scene",
    "solve",
    "write_only",
]


def __getattr__(name: str) -> Any:
    """Load a public name from its home on first use."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(_HOMES[name]), name)
    globals()[name] = value
    return value
