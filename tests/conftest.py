"""Rules for all tests: where the engine is missing, and where computed packings are kept."""

from __future__ import annotations

import os
import shutil
import signal
from typing import TYPE_CHECKING

import fake_engine
import pytest
from small_scenes import COLLISION, case_of

from liggghts_driver.engine.find import BINARY_VARIABLE
from liggghts_driver.rundir import RunDirectory

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from liggghts_driver.case import Case


def pytest_configure() -> None:
    """Let Ctrl-C reach the programs that tests start, also from a shell job in the background.

    Such a shell has its jobs ignore SIGINT, and what a process ignores, its children ignore too.
    """
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session", autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """No test reads or writes the user's cache."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="session")
def binary(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The stand-in for the engine as a program."""
    return fake_engine.install(tmp_path_factory.mktemp("engine"))


@pytest.fixture
def engine(binary: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """The stand-in in the engine's place, and how to choose its behaviour."""
    monkeypatch.setenv(BINARY_VARIABLE, str(binary))
    monkeypatch.setenv("FAKE_ENGINE", "")
    return lambda behaviour: monkeypatch.setenv("FAKE_ENGINE", behaviour)


@pytest.fixture
def run(tmp_path: Path) -> RunDirectory:
    """A run directory that is not there yet."""
    return RunDirectory(tmp_path / "run")


@pytest.fixture(scope="module")
def case() -> Case:
    """Two spheres that collide."""
    return case_of(COLLISION)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip what needs the engine where it is not installed; on a CI machine it must be."""
    if item.get_closest_marker("engine") is None:
        return
    needed = (os.environ.get(BINARY_VARIABLE, "liggghts"), "stdbuf")
    missing = [program for program in needed if shutil.which(program) is None]
    if not missing:
        return
    reason = f"not on the PATH: {', '.join(missing)}"
    if os.environ.get("CI"):
        pytest.fail(f"{reason}; with CI set a test of the engine is not skipped", pytrace=False)
    pytest.skip(reason)
