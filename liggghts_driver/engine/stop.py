"""The wish that a run end early: politely, with a checkpoint, or at once."""

from __future__ import annotations

import math
import time
from contextlib import contextmanager
from signal import SIGHUP, SIGINT, SIGTERM, SIGUSR1, signal
from threading import current_thread, main_thread
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import FrameType

#: Between two checkpoints the engine runs for some seconds at most; a full disk may be slow.
GRACE_S = 60.0


class Stop:
    """A wish that a run end. Asking twice ends it at once.

    Attributes
    ----------
    grace_s
        Time in which the engine may write a checkpoint before it is ended for good.
    checkpoint_every_s
        Wall time after which a run is asked for a checkpoint although nobody wishes it to end:
        it goes on from there, and what happens to the machine later costs no more than that.
    signal
        The signal that expressed the wish first; None if none did.
    """

    def __init__(self, grace_s: float = GRACE_S, checkpoint_every_s: float = math.inf) -> None:
        self.grace_s = grace_s
        self.checkpoint_every_s = checkpoint_every_s
        self.asked = False
        self.at_once = False
        self.signal: int | None = None

    def ask(self) -> None:
        """Wish that the run end. Called from signal handlers: only sets flags."""
        self.at_once = self.asked
        self.asked = True

    def watch(self, ask: Callable[[], None]) -> Callable[[], None]:
        """What to call now and then during a launch; calls ``ask`` when it is time to.

        It raises KeyboardInterrupt when waiting has an end.
        """
        start, is_asked, wished_at = time.monotonic(), False, math.inf

        def look() -> None:
            nonlocal is_asked, wished_at
            now = time.monotonic()
            if self.asked:
                wished_at = min(wished_at, now)
            if not is_asked and (self.asked or now - start > self.checkpoint_every_s):
                ask()
                is_asked = True
            if self.at_once or now - wished_at > self.grace_s:
                raise KeyboardInterrupt

        return look


@contextmanager
def signals_as_wishes(stop: Stop) -> Iterator[None]:
    """Take Ctrl-C, and the end of a terminal or of a batch job, for the wish to stop."""

    def wish(number: int, _frame: FrameType | None) -> None:
        stop.signal = stop.signal or number
        stop.ask()

    if current_thread() is not main_thread():
        yield  # only the main thread may set handlers
        return
    before = {number: signal(number, wish) for number in (SIGINT, SIGTERM, SIGHUP, SIGUSR1)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal(number, handler)
