"""What machine this is: processor and cores."""

from __future__ import annotations

import os
import platform
from pathlib import Path

_CPUINFO = Path("/proc/cpuinfo")


def this_machine(cpuinfo: Path = _CPUINFO) -> dict[str, str | int]:
    """Name of the processor, as far as the system tells it, and number of cores."""
    return {"cpu": _cpu(cpuinfo), "cores": os.cpu_count() or 1}


def _cpu(cpuinfo: Path) -> str:
    if cpuinfo.exists():
        for line in cpuinfo.read_text(encoding="utf-8").splitlines():
            name, _, value = line.partition(":")
            if name.strip() == "model name":
                return value.strip()
    return platform.processor() or platform.machine()
