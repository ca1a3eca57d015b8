"""Ctrl-C: it ends the work, but not between the writing of files and the words that name them."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

NOTHING_WRITTEN = "interrupted, nothing written"
STATUS = 130


def hold_interrupts() -> None:
    """Ignore Ctrl-C from now on: what is left to do is short, and then the command ends."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, _ignore)


@contextmanager
def interrupts_restored() -> Iterator[None]:
    """Put back at the end what Ctrl-C did at the beginning."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.getsignal(signal.SIGINT)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)


def _ignore(number: int, frame: FrameType | None) -> None:
    """Handle the signal without an effect; SIG_IGN would pass on to processes started later."""
