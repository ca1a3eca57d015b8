"""What the interpreter meets: other threads, signals in a call, no memory, errors that name."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from support import parameter_of

MODEL = mh.paper.table_1_recovered()
LIMITS = (-500.0, 500.0)
WORD: Any = "fast"


class Slow:
    """A sequence whose conversion lets other threads run."""

    def __init__(self, switch: Callable[[], object]) -> None:
        self.switch = switch

    def __array__(self, dtype: Any = None, copy: Any = None) -> np.ndarray:
        self.switch()
        return np.array([1.0, 2.0])


@pytest.mark.parametrize(
    "use",
    [
        lambda stream, drives: stream.run(drives),
        lambda stream, drives: stream.follow(drives),
    ],
)
def test_nothing_is_borrowed_while_arguments_are_converted(use: Callable[[Any, Any], Any]) -> None:
    stream = MODEL.inverse(LIMITS)
    seen = []
    use(stream, Slow(lambda: seen.append(stream.step(0.5))))
    mirror = mh.ActuatorArray([MODEL, MODEL]).forward()
    mirror.step(Slow(lambda: mirror.step([1.0, 2.0])))


class Mapping(dict[str, Any]):
    """A state whose items are looked at in Python."""

    def __init__(self, state: dict[str, Any], switch: Callable[[], object]) -> None:
        super().__init__(state)
        self.switch = switch

    def __getitem__(self, name: str) -> Any:
        self.switch()
        return super().__getitem__(name)


def test_nothing_is_borrowed_while_a_state_is_converted() -> None:
    stream = MODEL.forward()
    stream.state = Mapping(stream.state, lambda: stream.step(0.5))
    assert stream.peek(0.0) == MODEL.forward().step(0.0)


def test_threads_share_a_stream_without_errors() -> None:
    stream, errors = MODEL.forward(), list[BaseException]()

    def call(work: Callable[[], object]) -> None:
        try:
            for _ in range(3000):
                work()
        except BaseException as error:
            errors.append(error)

    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        works: list[Callable[[], object]] = [lambda: stream.run([1.0, 2.0]), lambda: stream.step(3)]
        threads = [threading.Thread(target=call, args=(work,)) for work in works]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        sys.setswitchinterval(before)
    assert errors == []


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="needs an interval timer")
def test_a_handler_that_uses_what_a_run_uses_is_told_so() -> None:
    stream, samples, told = MODEL.forward(), np.zeros(1 << 24), list[str]()
    out = np.empty_like(samples)

    def handler(*_: object) -> None:
        for use in (lambda: stream.step(1.0), lambda: MODEL.forward().run(samples, out=out)):
            try:  # the signal may come before the run has begun
                use()
            except RuntimeError as error:
                told.append(str(error))

    previous = signal.signal(signal.SIGALRM, handler)
    try:
        # A run may be done before it looks for signals: then another one.
        for _ in range(50):
            signal.setitimer(signal.ITIMER_REAL, 0.005)
            stream.run(samples, out=out)
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            if told:
                break
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, previous)
    words = "is in use by a call that has not returned"
    assert told == [f"this Forward {words}", f"out {words}"]


def test_what_does_not_fit_in_memory_is_a_memory_error() -> None:
    endless = np.broadcast_to(np.float64(0.5), (1 << 45,))
    with pytest.raises(MemoryError):
        MODEL.forward().run(endless)
    with pytest.raises(MemoryError):
        mh.plant.Plant(MODEL, dt=1e-4).run(endless)
    with pytest.raises((MemoryError, ValueError)):
        mh.trajectories.Sine(1.0, 1.0).sample(1e-9, 1e9)


@pytest.mark.parametrize(
    ("call", "kind", "parameter"),
    [
        (lambda: mh.Play(WORD), TypeError, "r"),
        (lambda: mh.Play(-1.0), ValueError, "r"),
        (lambda: mh.PrandtlIshlinskii([1.0], [0.0], input_offset=WORD), TypeError, "input_offset"),
        (lambda: mh.PrandtlIshlinskii([1.0, 2.0], [0.0]), ValueError, "thresholds"),
        (lambda: MODEL.forward().run([[1.0]]), ValueError, "input"),
        (lambda: MODEL.forward().run([1j]), TypeError, "input"),
        (lambda: MODEL.inverse(range(10**11)), TypeError, "limits"),
        (lambda: MODEL.inverse().run(range(10**11)), MemoryError, "input"),
        (lambda: mh.ActuatorArray([MODEL, WORD]), TypeError, "models"),
        (lambda: mh.plant.SecondOrder(-1.0, 0.1), ValueError, "frequency"),
        (lambda: mh.plant.Plant(MODEL, dt=0.0), ValueError, "dt"),
        (lambda: mh.Stage(MODEL, dynamics=WORD), TypeError, "dynamics"),
        (lambda: mh.identify([0.0, 1.0], [0.0, np.nan]), ValueError, "y"),
        (lambda: mh.identify([0.0, 1.0], [0.0]), ValueError, "y"),
        (lambda: mh.identify(range(99), range(99), operators=2**63), ValueError, "operators"),
        (lambda: mh.identify(range(99), range(99), skip="2 s"), ValueError, "skip"),
        (lambda: mh.trajectories.Sine(1.0, 0.0), ValueError, "frequency"),
        (lambda: mh.signals.sine(1.0, 1.0, seconds=-1.0), ValueError, "seconds"),
    ],
)
def test_errors_name_the_argument(
    call: Callable[[], Any], kind: type[Exception], parameter: str
) -> None:
    with pytest.raises(kind) as caught:
        call()
    assert parameter_of(caught.value) == parameter
    assert parameter in str(caught.value)


def test_times_stand_for_samples() -> None:
    u = mh.signals.decaying_triangle(500.0, 1.0, cycles=6, rate=100)
    y = MODEL.forward().run(u)
    fixed: dict[str, Any] = {"ratios": (0.95, 0.3, 0.35), "input_offset": 0.0, "operators": 4}
    one = mh.identify(u, y, dt=0.01, skip="500ms", validate="4s", **fixed)
    other = mh.identify(u, y, dt=0.01, skip=50, validate=400, **fixed)
    assert (one.fit.samples, one.model) == (350, other.model)
