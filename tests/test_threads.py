"""Real threads: objects that are shared, and objects that another call is using."""

from __future__ import annotations

import signal
import sys
import sysconfig
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest

MODEL = mh.paper.table_1_recovered()
LIMITS = (-500.0, 500.0)
STAGE = mh.Stage(
    MODEL,
    limits=LIMITS,
    slew=1e5,
    dynamics=mh.plant.SecondOrder(400.0, 0.9),
    creep=mh.plant.Creep([0.01], [1.0]),
)
DT = 1e-4
PAIR = mh.ActuatorArray([MODEL, MODEL])
STAGES = mh.ActuatorArray([STAGE, STAGE])
GAINS = {"kp": 0.0, "ki": 20.0, "slope": 1.0, "dynamics": STAGE.dynamics, "dt": DT}


def axes() -> mh.control.MultiAxisController:
    return mh.control.MultiAxisController([STAGE.controller(DT), STAGE.controller(DT)])


def plants() -> mh.plant.MultiAxisPlant:
    return mh.plant.MultiAxisPlant([STAGE.plant(DT), STAGE.plant(DT)], np.eye(2))


class Case:
    """An object that changes with every call, one sample for it, and many."""

    def __init__(self, make: Callable[[], Any], one: tuple[Any, ...], inputs: int, width: int = 0):
        self.make, self.one, self.inputs, self.width = make, one, inputs, width

    def many(self, samples: int) -> tuple[Any, ...]:
        shape = (samples, self.width) if self.width else (samples,)
        return tuple(np.full(shape, 0.25) for _ in range(self.inputs))


# The classes with `run`; the last number is how many samples a row has.
RUNS = {
    "Play": Case(lambda: mh.Play(0.1), (0.5,), 1),
    "CoupledPlay": Case(lambda: mh.CoupledPlay(0.1, 0.1, 0.1, 0.1), (0.5,), 1),
    "Forward": Case(MODEL.forward, (0.5,), 1),
    "Inverse": Case(lambda: MODEL.inverse(LIMITS), (0.5,), 1),
    "StageForward": Case(lambda: STAGE.forward(DT), (0.5,), 1),
    "StageInverse": Case(lambda: STAGE.inverse(DT), (0.5,), 1),
    "Filter": Case(lambda: mh.control.Filter(mh.control.LowPass(100.0), DT), (0.5,), 1),
    "Observer": Case(lambda: STAGE.observer(DT, drift=0.1, noise=0.01), (0.5, 0.1), 2),
    "HybridController": Case(lambda: STAGE.controller(DT), (0.5, 0.1), 2),
    "MultiAxisController": Case(axes, ([0.5, 0.5], [0.1, 0.1]), 2, 2),
    "ArrayController": Case(lambda: PAIR.controller(DT, LIMITS), ([0.5, 0.5],), 1, 2),
    "ForwardArray": Case(PAIR.forward, ([0.5, 0.5],), 1, 2),
    "InverseArray": Case(lambda: PAIR.inverse(LIMITS), ([0.5, 0.5],), 1, 2),
    "ArrayController of stages": Case(lambda: STAGES.controller(DT, LIMITS), ([0.5, 0.5],), 1, 2),
    "ForwardArray of stages": Case(lambda: STAGES.forward(dt=DT), ([0.5, 0.5],), 1, 2),
    "InverseArray of stages": Case(lambda: STAGES.inverse(LIMITS, dt=DT), ([0.5, 0.5],), 1, 2),
    "Plant": Case(lambda: STAGE.plant(DT), (0.5,), 1),
    "MultiAxisPlant": Case(plants, ([0.5, 0.5],), 1, 2),
}
# Those that take sample after sample only.
STEPS = {
    "Bracket": Case(STAGE.bracket, (0.5,), 0),
    "BracketArray": Case(lambda: PAIR.bracket(LIMITS), ([0.5, 0.5],), 0),
    "RepetitiveControl": Case(lambda: mh.control.RepetitiveControl(50, **GAINS), (0.1,), 0),
    "RecursiveIdentifier": Case(lambda: mh.RecursiveIdentifier(MODEL), (0.5, 0.1), 0),
}
CASES = RUNS | STEPS


def use(made: Any, *arguments: Any) -> object:
    """Take one sample."""
    return (made.step if hasattr(made, "step") else made.update)(*arguments)


def same(a: Any, b: Any) -> bool:
    return repr(a) == repr(b)


@contextmanager
def fast_switches() -> Iterator[None]:
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        yield
    finally:
        sys.setswitchinterval(before)


def at_once(works: list[Callable[[], object]]) -> list[BaseException]:
    """Do the works in threads that begin together; return what they raised."""
    errors, begin = list[BaseException](), threading.Barrier(len(works))

    def call(work: Callable[[], object]) -> None:
        try:
            begin.wait()
            work()
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=call, args=(work,)) for work in works]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return errors


@pytest.mark.parametrize("name", CASES)
def test_calls_of_threads_come_one_after_the_other(name: str) -> None:
    case = CASES[name]
    shared = case.make()
    start, many = shared.state, case.many(1000)

    def again(work: Callable[[], object], times: int) -> Callable[[], object]:
        return lambda: [work() for _ in range(times)]

    def restore() -> None:
        shared.state = start

    works = [again(lambda: use(shared, *case.one), 500), again(lambda: shared.state, 200)]
    works.append(again(restore, 100))
    if hasattr(shared, "peek"):
        works.append(again(lambda: shared.peek(*case.one), 500))
    if case.inputs:
        works.append(again(lambda: shared.run(*many), 50))
    with fast_switches():
        assert at_once(works) == []
    # What is left is a state of that object, and goes on as in one that was never shared.
    alone = case.make()
    alone.state = shared.state
    for _ in range(3):
        assert same(use(alone, *case.one), use(shared, *case.one))
    assert same(alone.state, shared.state)


@pytest.mark.parametrize("name", ["Forward", "Inverse", "StageForward", "StageInverse", "Plant"])
def test_no_sample_of_two_threads_is_lost(name: str) -> None:
    # Bad samples are counted and change nothing else: so the count does not depend on the order.
    case = CASES[name]
    shared = case.make()
    with fast_switches():
        many = np.full(100, np.nan)
        assert (
            at_once(
                [
                    lambda: [use(shared, np.nan) for _ in range(2000)],
                    lambda: [use(shared, np.nan) for _ in range(2000)],
                    lambda: [shared.run(many) for _ in range(50)],
                ]
            )
            == []
        )
    assert shared.rejected == 9000


def met_in_a_run(case: Case, made: Any, uses: dict[str, Callable[[], object]]) -> dict[str, str]:
    """Use an object in a second thread while a run of the first is at work; return the errors."""
    many, told = case.many(1 << (21 if case.width else 22)), dict[str, str]()

    def call(what: str) -> None:
        try:
            uses[what]()
        except RuntimeError as error:
            told[what] = str(error)
        else:
            told[what] = "no error"

    def handler(*_: object) -> None:
        for what in uses:
            other = threading.Thread(target=call, args=(what,))
            other.start()
            other.join()

    before = signal.signal(signal.SIGALRM, handler)
    try:
        while not told:  # the first signals may come before the run has begun
            signal.setitimer(signal.ITIMER_REAL, 1e-3)
            made.run(*many)
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            if "no error" in told.values():
                told.clear()
    finally:
        signal.signal(signal.SIGALRM, before)
    return told


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="needs an interval timer")
@pytest.mark.parametrize("name", RUNS)
def test_an_object_in_a_run_says_so_to_other_threads(name: str) -> None:
    case = RUNS[name]
    made, few = case.make(), case.many(3)
    state = made.state
    uses: dict[str, Callable[[], object]] = {
        "step": lambda: use(made, *case.one),
        "run": lambda: made.run(*few),
        "state": lambda: made.state,
        "set state": lambda: setattr(made, "state", state),
        "reset": lambda: made.reset(),
    }
    if hasattr(made, "peek"):
        uses["peek"] = lambda: made.peek(*case.one)
    expected = f"this {name.split()[0]} is in use by a call that has not returned"
    assert met_in_a_run(case, made, uses) == dict.fromkeys(uses, expected)
    # The run went on undisturbed.
    alone = case.make()
    for _ in range(3):
        made.state = alone.state
        assert same(use(made, *case.one), use(alone, *case.one))


def test_a_plant_that_uses_its_controller_is_told_so() -> None:
    controller, told = STAGE.controller(DT), list[str]()

    class Bench:
        def read(self) -> float:
            with pytest.raises(RuntimeError) as caught:
                controller.step(0.0, 0.0)
            told.append(str(caught.value))
            return 0.0

        def write(self, drive: float) -> None:
            del drive

    mh.plant.simulate(controller, Bench(), [0.0, 0.1])
    expected = "this HybridController is in use by a call that has not returned"
    assert told and set(told) == {expected}


def test_models_and_stages_are_shared() -> None:
    """Many threads make streams of one model and one stage: the bits are those of one thread."""
    drives = np.random.default_rng(1).uniform(-400.0, 400.0, 20_000)
    targets = np.random.default_rng(2).uniform(-2.0, 2.0, 20_000)

    def everything() -> bytes:
        outputs = [
            MODEL.forward().run(drives),
            MODEL.inverse(LIMITS).run(targets),
            STAGE.forward(DT).run(drives),
            STAGE.inverse(DT).run(targets),
            STAGE.controller(DT).run(targets, targets),
            PAIR.inverse(LIMITS).run(targets.reshape(-1, 2), threads=2),
            STAGE.plant(DT, seed=3).run(drives)[0],
        ]
        return b"".join(output.tobytes() for output in outputs)

    alone, found = everything(), list[bytes]()
    with fast_switches():
        works: list[Callable[[], object]] = [lambda: found.append(everything())] * 8
        assert at_once(works) == []
    assert found == [alone] * 8


@pytest.mark.skipif(
    not sysconfig.get_config_var("Py_GIL_DISABLED"), reason="needs a free-threaded Python"
)
def test_the_module_asks_for_the_lock_of_the_interpreter() -> None:
    # Without the lock another thread could write to an array that a run reads.
    # By its name as a text: the type stubs of older Pythons do not have it.
    enabled: Callable[[], bool] = getattr(sys, "_is_gil_enabled")  # noqa: B009
    assert enabled()
