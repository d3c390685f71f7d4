"""One text for equal data: what hashes are taken of."""

from __future__ import annotations

import json


def canonical_json(data: object) -> str:
    """One text for equal data: sorted keys, no blanks."""
    return json.dumps(data, sort_keys=True, separators=(",", ":"), allow_nan=False)
