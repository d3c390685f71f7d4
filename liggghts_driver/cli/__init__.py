"""The command line: the only part that prints or exits."""

from __future__ import annotations

import json
import sys

from liggghts_driver.errors import DriverError


def main() -> None:
    """Run the command line; errors raised on purpose become one message, without a traceback."""
    from liggghts_driver.cli.app import app

    try:
        app()
    except DriverError as error:
        if "--json" in sys.argv:
            print(json.dumps({"error": type(error).__name__, "message": str(error)}))
        print(f"error: {error}", file=sys.stderr)
        sys.exit(error.exit_code)
