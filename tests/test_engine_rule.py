"""Where the engine is missing its tests are skipped, with the reason; on a CI machine they fail."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest


@pytest.mark.engine
def test_a_test_of_the_engine_finds_it() -> None:
    assert shutil.which(os.environ.get("LIGGGHTS_DRIVER_BINARY", "liggghts"))


@pytest.mark.parametrize(("ci", "outcome"), [(None, "1 skipped"), ("true", "1 error")])
def test_without_the_engine(ci: str | None, outcome: str, tmp_path: Path) -> None:
    one = f"{Path(__file__)}::test_a_test_of_the_engine_finds_it"
    known = {name: value for name, value in os.environ.items() if name != "CI"}
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", one],
        env={**known, "PATH": str(tmp_path), **({"CI": ci} if ci else {})},
        capture_output=True,
        text=True,
        check=False,
    )
    assert outcome in done.stdout
    assert "not on the PATH: liggghts, stdbuf" in done.stdout
    assert done.returncode == (1 if ci else 0)
