"""The command line: the only part that prints or exits."""

from __future__ import annotations

import json
import sys

from liggghts_driver.errors import DriverError


def main() -> None:
    """Run the command line; errors raised on purpose become one message, without a traceback.

    So do a full disk and its like, and Ctrl-C while nothing runs yet.
    """
    try:
        from liggghts_driver.cli.app import app

        app()
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        sys.exit(130)
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        _say(type(error).__name__, f"{place}{error.strerror or error}")
        sys.exit(1)
    except DriverError as error:
        _say(type(error).__name__, str(error))
        sys.exit(error.exit_code)


def _say(kind: str, message: str) -> None:
    if "--json" in sys.argv:
        print(json.dumps({"error": kind, "message": message}))
    print(f"error: {message}", file=sys.stderr)
