"""Signals that end a command: Ctrl-C ends the work, but is ignored once files are written."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

_ENDING = [getattr(signal, name, None) for name in ("SIGINT", "SIGTERM", "SIGHUP")]
_SIGNALS = [number for number in _ENDING if number is not None]  # Windows has no SIGHUP


def hold_interrupts() -> None:
    """Ignore Ctrl-C from now on. The command ends shortly after."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, _ignore)


def call_at_interrupts(action: Callable[[], object]) -> None:
    """Call `action` at Ctrl-C, SIGTERM and SIGHUP from now on; an ignored signal stays so."""
    if threading.current_thread() is not threading.main_thread():
        return
    for number in _SIGNALS:
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, lambda *_: action())


@contextmanager
def interrupts_restored(*, ends_process: bool = False) -> Iterator[None]:
    """Restore the handlers of these signals at the end, or ignore what comes while Python ends."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in _SIGNALS}
    try:
        yield
    finally:
        for number, handler in before.items():
            restored = signal.SIG_DFL if handler is None else handler
            signal.signal(number, signal.SIG_IGN if ends_process else restored)


def _ignore(number: int, frame: FrameType | None) -> None:
    """Do nothing. Unlike SIG_IGN this is not inherited by child processes."""
