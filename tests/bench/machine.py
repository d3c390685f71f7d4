"""What the figures were measured on."""

from __future__ import annotations

import platform

from liggghts_driver.engine.find import find_engine
from liggghts_driver.machine import this_machine


def description() -> str:
    """One line: processor, cores, system, engine."""
    machine = this_machine()
    return (
        f"{machine['cpu']}, {machine['cores']} cores (shared), Linux, "
        f"Python {platform.python_version()}, LIGGGHTS {find_engine().version}"
    )
