"""The command line: the only part that prints or exits."""

from __future__ import annotations

import errno
import json
import sys
import tempfile
import traceback
from pathlib import Path
from typing import cast

from liggghts_driver.errors import DriverError

#: Exit code of a command that Ctrl-C ended.
EXIT_INTERRUPTED = 130


def main() -> None:
    """Run the command line; whatever goes wrong becomes one message, without a traceback.

    With ``--json`` it is a document on the standard output too, a wrong option as much as a full
    disk, or Ctrl-C while nothing runs yet.
    """
    code = 0
    try:
        code = _run()
    except KeyboardInterrupt:
        code = _say("Interrupted", "interrupted", EXIT_INTERRUPTED)
    except DriverError as error:
        code = _say(type(error).__name__, str(error), error.exit_code)
    except MemoryError as error:
        words = f"there is not enough memory: {error}" if str(error) else "memory ran out"
        code = _say("MemoryError", f"{words}; is the number of particles right?", 1)
    except OSError as error:
        code = _say(type(error).__name__, _of_the_system(error), 1)
    except Exception as error:  # noqa: BLE001 - a bug, which is told as one
        code = _say("InternalError", _bug(error), 1)
    sys.exit(code)


def _run() -> int:
    """Run a command; its exit code."""
    import typer

    from liggghts_driver.cli.app import app
    from liggghts_driver.cli.options import INTERRUPTED

    # ClickException, wherever this version of typer has it.
    mistake = cast("type[typer.BadParameter]", typer.BadParameter.__mro__[2])
    try:
        code = app(standalone_mode=False) or 0
    except mistake as error:
        error.show()
        if _as_json():
            _document("UsageError", error.format_message())
        return int(error.exit_code)
    if code == EXIT_INTERRUPTED and code is not INTERRUPTED:
        raise KeyboardInterrupt  # typer made an exit code of it
    return int(code)


def _as_json() -> bool:
    return "--json" in sys.argv


def _document(kind: str, message: str) -> None:
    print(json.dumps({"error": kind, "message": message}))


def _say(kind: str, message: str, code: int) -> int:
    if _as_json():
        _document(kind, message)
    start = "" if code == EXIT_INTERRUPTED else "error: "
    print(f"{start}{message}", file=sys.stderr)
    return code


def _of_the_system(error: OSError) -> str:
    place = f"{error.filename}: " if error.filename else ""
    more = "; free some, and the same command goes on" if error.errno == errno.ENOSPC else ""
    return f"{place}{error.strerror or error}{more}"


def _bug(error: Exception) -> str:
    """What to tell of an error that nobody foresaw; its traceback is kept in a file."""
    text = "".join(traceback.format_exception(error))
    last = traceback.extract_tb(error.__traceback__)[-1]
    with tempfile.NamedTemporaryFile(
        "w", prefix="liggghts-driver-", suffix=".txt", delete=False, encoding="utf-8"
    ) as file:
        file.write(f"{' '.join(sys.argv)}\n\n{text}")
    where = f"{Path(last.filename).name}, line {last.lineno}"
    return (
        f"a mistake of liggghts-driver itself, at {where}: {type(error).__name__}: {error}; please "
        f"report it with {file.name}"
    )
