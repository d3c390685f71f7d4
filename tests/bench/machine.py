"""What the figures were measured on."""

from __future__ import annotations

import os
import platform
from pathlib import Path

from liggghts_driver.engine.find import find_engine


def description() -> str:
    """One line: processor, cores, system, engine."""
    model = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        lines = cpuinfo.read_text(encoding="utf-8").splitlines()
        named = (line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
        model = next(named, model)
    return (
        f"{model}, {os.cpu_count()} cores (shared), Linux, Python {platform.python_version()}, "
        f"LIGGGHTS {find_engine().version}"
    )
