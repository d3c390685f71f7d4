"""Every error this package raises on purpose, one class per place where things can fail.

The command line turns them into one message without a traceback; ``exit_code`` is what it exits
with. Anything else that escapes is a defect of the package.
"""

from __future__ import annotations


class DriverError(Exception):
    """Root of all errors raised on purpose."""

    exit_code = 1


class SceneError(DriverError):
    """The scene, or an override of it, asks for something that cannot be."""

    exit_code = 2


class SweepError(DriverError):
    """The sweep file, or a scene that it makes, asks for something that cannot be."""

    exit_code = 2


class PackingError(DriverError):
    """The wanted spheres cannot be placed."""

    exit_code = 2


class DeckError(DriverError):
    """A deck could not be written from its template."""


class EngineNotFoundError(DriverError):
    """The engine, or a program needed to launch it, is not on this machine."""


class RunError(DriverError):
    """The engine failed, or did not finish what the deck asked for."""


class RunUnstableError(RunError):
    """The run went where no valid answer is: it was stopped, or lost particles.

    Its message says what was seen, when, at which particle or contact, and what to do.
    """


class RunFolderError(DriverError):
    """The run directory holds something that must not be overwritten."""

    exit_code = 2


class RunBusyError(RunFolderError):
    """Another process works in the run directory."""


class RunInterrupted(KeyboardInterrupt):
    """A run was asked to end, and did at a checkpoint, from which it can go on.

    Like Ctrl-C it passes through whatever only deals with errors.
    """


class ParseError(DriverError):
    """A file written by the engine is not what it should be."""
