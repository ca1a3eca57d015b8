"""Ctrl-C: it ends the work, but is ignored once files are written."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

NOTHING_WRITTEN = "interrupted, nothing written"
STATUS = 130


def hold_interrupts() -> None:
    """Ignore Ctrl-C from now on. The command ends shortly after."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, _ignore)


@contextmanager
def interrupts_restored() -> Iterator[None]:
    """Restore the handler of Ctrl-C at the end."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.getsignal(signal.SIGINT)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)


def _ignore(number: int, frame: FrameType | None) -> None:
    """Do nothing. Unlike SIG_IGN this is not inherited by child processes."""
