"""Computed packings kept on disk, so that the same packing is made once.

A packing is a pure function of its inputs (the seed among them), so its file is named by their
hash, is never changed and may be deleted at any time. The cache never makes a run fail: whatever
is wrong with it, the packing is computed.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from typing import Any, TypeAlias

    from numpy.typing import NDArray

    JSON: TypeAlias = str | int | float | bool | Sequence["JSON"] | Mapping[str, "JSON"] | None
    Arrays: TypeAlias = dict[str, NDArray[Any]]

ALGORITHM_VERSION = 1
"""Raised with every change that changes a packing, so that older files are passed over."""

_DIGEST_BYTES = hashlib.sha256().digest_size  # the archive's own hash, appended to it
_IDENTITY = "identity"
_DATA = "data_"  # set before every name, so that none can collide with the identity


def cached_packing(
    kind: str,
    inputs: Mapping[str, JSON],
    compute: Callable[[], Mapping[str, NDArray[Any]]],
) -> Arrays:
    """Return what ``compute`` returns, from disk if it was computed before.

    Files are ``liggghts-driver/packings/<hash>.npz`` under ``$XDG_CACHE_HOME`` or ``~/.cache``.
    A file that is damaged or made from other inputs is computed anew and replaced; a folder that
    cannot be found, read or written only means that nothing is kept.

    Parameters
    ----------
    kind
        What is computed.
    inputs
        Everything that the result depends on, the random seed included.
    compute
        The computation; its arrays hold numbers, not objects.

    Returns
    -------
    dict[str, NDArray]
        The arrays by name.

    Raises
    ------
    TypeError, ValueError
        If ``inputs`` is not JSON; NaN and infinity are not.
    """
    identity = json.dumps(
        {"kind": kind, "inputs": inputs, "version": ALGORITHM_VERSION},
        sort_keys=True,
        separators=(",", ":"),
        allow_nan=False,
    )
    folder = _folder()
    if folder is None:
        return dict(compute())
    path = folder / f"{hashlib.sha256(identity.encode()).hexdigest()}.npz"
    stored = _read(path, identity)
    if stored is not None:
        return stored
    arrays = dict(compute())
    with suppress(OSError):  # a full or read-only disk: the packing is simply not kept
        _write(path, identity, arrays)
    return arrays


def _folder() -> Path | None:
    """Return the cache folder, or None where there is no home to put it in."""
    # The XDG rules: a path that is empty or relative counts as not set.
    root = Path(os.environ.get("XDG_CACHE_HOME", ""))
    if not root.is_absolute():
        try:
            root = Path.home() / ".cache"
        except RuntimeError:
            return None
    return root / "liggghts-driver" / "packings"


def _read(path: Path, identity: str) -> Arrays | None:
    """Return the stored arrays, or None if there is no sound file made from these inputs."""
    try:
        content = path.read_bytes()
    except OSError:
        return None
    archive, digest = content[:-_DIGEST_BYTES], content[-_DIGEST_BYTES:]
    # Checked before the archive is opened: a damaged one can also read well and lack an array.
    if hashlib.sha256(archive).digest() != digest:
        return None
    with np.load(io.BytesIO(archive), allow_pickle=False) as file:
        if str(file[_IDENTITY]) != identity:
            return None
        return {name.removeprefix(_DATA): file[name] for name in file.files if name != _IDENTITY}


def _write(path: Path, identity: str, arrays: Arrays) -> None:
    """Write beside the target and rename, so that no reader ever sees half a file."""
    members: dict[str, Any] = {_DATA + name: array for name, array in arrays.items()}
    members[_IDENTITY] = np.array(identity)
    buffer = io.BytesIO()
    np.savez(buffer, **members)
    archive = buffer.getvalue()
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".tmp")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(archive + hashlib.sha256(archive).digest())
        Path(temporary).replace(path)
    except BaseException:
        Path(temporary).unlink()
        raise
