"""The one fixture of these tests: run scenes."""

from __future__ import annotations

import pytest

from .support import Simulator


@pytest.fixture(scope="session")
def simulator(tmp_path_factory: pytest.TempPathFactory) -> Simulator:
    """Runs scenes with the real engine, each in a folder of its own."""
    return Simulator(tmp_path_factory.mktemp("engine"))
