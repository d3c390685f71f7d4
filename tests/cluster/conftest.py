"""The fixtures of these tests: a cluster at rest, and one with small arrays."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import pytest

from .slurm import Cluster, why_not

if TYPE_CHECKING:
    from collections.abc import Iterator


@pytest.fixture(scope="session")
def _can_have_one() -> None:
    """Skip, with the reason, on a machine that cannot have a cluster; on a CI machine fail."""
    reason = why_not()
    if reason and os.environ.get("CI"):
        pytest.fail(f"{reason}; with CI set a test of the cluster is not skipped", pytrace=False)
    if reason:
        pytest.skip(reason)


@pytest.fixture(scope="session")
def _cluster(_can_have_one: None) -> Iterator[Cluster]:
    with Cluster() as cluster:
        yield cluster


@pytest.fixture(scope="session")
def narrow(_can_have_one: None) -> Iterator[Cluster]:
    """A cluster whose arrays have three tasks at most."""
    with Cluster({"MaxArraySize": "3"}) as cluster:
        yield cluster


@pytest.fixture
def cluster(_cluster: Cluster, monkeypatch: pytest.MonkeyPatch) -> Cluster:
    """A cluster without jobs, both nodes idle; this process and what it starts find it."""
    if not _cluster.at_rest():
        _cluster.stop()
        _cluster.start()
    monkeypatch.setenv("SLURM_CONF", _cluster.environment()["SLURM_CONF"])
    return _cluster
