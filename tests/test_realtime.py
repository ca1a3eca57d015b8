"""The loop in real time from Python. Only counts are looked at: times are those of the machine."""

from __future__ import annotations

import ctypes
import json
import pickle
import re
import signal
import socket
import struct
import threading
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest

RATE = 1000.0
SLEW = 2e4  # V/s
REST: dict[str, Any] = {"rest_drive": -10.0, "rest_rate": 5e3}


def sine() -> Any:
    return mh.signals.sine(2.0, 10.0, seconds=0.1, rate=RATE)


STAGE = mh.paper.plant("A1").stage.replace(slew=SLEW)
SLOW = STAGE.replace(dynamics=mh.plant.FirstOrder(0.01))


@pytest.fixture(scope="module")
def stage() -> mh.Stage:
    return STAGE


@pytest.fixture
def controller(stage: mh.Stage) -> mh.control.HybridController:
    return stage.controller(1 / RATE)


def plant(stage: mh.Stage) -> mh.plant.Plant:
    return mh.plant.Plant(stage, dt=1 / RATE)


class Bench:
    """A plant in Python."""

    def __init__(self, stage: mh.Stage) -> None:
        self.plant = plant(stage)
        self.drives: list[float] = []
        self.measured: float | None = 0.0

    def read(self) -> float | None:
        return self.measured

    def write(self, drive: float) -> None:
        self.measured = self.plant.step(drive)
        self.drives.append(drive)


def test_a_plant_and_its_controller_go_on_from_the_rest(
    stage: mh.Stage, controller: mh.control.HybridController, tmp_path: Path
) -> None:
    simulated, path = plant(stage), tmp_path / "record.npy"
    seen: list[dict[str, Any]] = []
    report = mh.realtime.run(
        controller, simulated, sine(), **REST, seconds=0.4, record=path, progress=seen.append
    )
    assert (report.end, report.at_rest, report.last_drive) == ("time_over", True, -10.0)
    assert simulated.drive == controller.drive == -10.0
    assert controller.mode == "stop"
    record = np.load(path)
    assert record.dtype.names == ("time", "reference", "measurement", "drive", "lateness")
    assert len(record) == report.taken == report.latency.count == report.compute.count
    assert report.taken + report.skipped >= 400
    assert np.abs(np.diff(record["drive"], prepend=0.0)).max() <= SLEW / RATE
    assert seen and set(seen[0]) == {
        "taken", "missed", "skipped", "stale", "measurement", "drive", "waiting"
    }  # fmt: skip


def test_a_report_is_a_plain_value(stage: mh.Stage) -> None:
    report = mh.realtime.run(stage, plant(stage), sine(), **REST, rate=RATE, repeat=False)
    assert report.end == "reference_over"
    values = report.to_dict()
    text = json.dumps(values)
    assert json.dumps(json.loads(text)) == text
    assert values["deadlines"]["taken"] == report.taken
    assert pickle.loads(pickle.dumps(report)).to_dict() == values
    assert sum(count for _, count in report.period.histogram) == report.taken - 1


def test_an_object_in_python_is_driven(
    stage: mh.Stage, controller: mh.control.HybridController
) -> None:
    bench = Bench(stage)
    report = mh.realtime.run(
        controller, bench, sine(), **REST, seconds=0.2, misses="catch_up", watchdog=(0.05, 10.0)
    )
    assert (report.end, bench.drives[-1], len(bench.drives)) == ("time_over", -10.0, report.taken)


def test_what_an_object_raises_is_raised_at_rest(
    stage: mh.Stage, controller: mh.control.HybridController
) -> None:
    bench = Bench(stage)

    def read() -> float:
        if len(bench.drives) == 100:
            raise RuntimeError("no light on the sensor")
        return 0.0

    bench.read = read  # type: ignore[method-assign]
    with pytest.raises(RuntimeError, match="no light on the sensor"):
        mh.realtime.run(controller, bench, sine(), **REST)
    assert bench.drives[-1] == controller.drive == -10.0
    assert np.abs(np.diff(bench.drives)).max() <= SLEW / RATE


def test_without_measurements_it_rests(
    stage: mh.Stage, controller: mh.control.HybridController
) -> None:
    bench = Bench(stage)
    bench.read = lambda: None  # type: ignore[method-assign]
    report = mh.realtime.run(controller, bench, sine(), **REST, watchdog=(0.0, 0.05))
    assert (report.end, report.at_rest, report.stale) == ("watchdog", True, report.taken)


def test_control_c_ends_the_loop_and_not_the_program(
    stage: mh.Stage, controller: mh.control.HybridController
) -> None:
    def progress(shown: dict[str, Any]) -> None:
        if shown["taken"] > 0:
            signal.raise_signal(signal.SIGINT)

    # A program that was started in the background ignores Ctrl-C.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        report = mh.realtime.run(controller, plant(stage), sine(), **REST, progress=progress)
    finally:
        signal.signal(signal.SIGINT, before)
    assert (report.end, report.at_rest) == ("requested", True)


def test_what_progress_raises_is_raised_at_rest(
    stage: mh.Stage, controller: mh.control.HybridController
) -> None:
    def progress(_: dict[str, Any]) -> None:
        raise RuntimeError("the window was closed")

    with pytest.raises(RuntimeError, match="the window was closed"):
        mh.realtime.run(controller, plant(stage), sine(), **REST, progress=progress)
    assert controller.drive == -10.0


def test_functions_of_c_are_driven(
    stage: mh.Stage, controller: mh.control.HybridController
) -> None:
    bench = Bench(stage)

    def read(_: int, measurement: Any) -> int:
        measurement[0] = bench.read()
        return 0

    def write(_: int, drive: float) -> int:
        bench.write(drive)
        return 0

    number, context = ctypes.c_double, ctypes.c_void_p
    reader = ctypes.CFUNCTYPE(ctypes.c_int, context, ctypes.POINTER(number))(read)
    writer = ctypes.CFUNCTYPE(ctypes.c_int, context, number)(write)
    address = ctypes.cast(writer, ctypes.c_void_p).value
    assert address is not None
    io = mh.realtime.Functions(reader, address)
    report = mh.realtime.run(controller, io, sine(), **REST, seconds=0.2)
    assert (report.end, bench.drives[-1], len(bench.drives)) == ("time_over", -10.0, report.taken)
    for wrong in (0, "read", 1.5, None):
        with pytest.raises((TypeError, ValueError), match=r"^write: expected a function of ctypes"):
            mh.realtime.Functions(reader, wrong)


def test_datagrams_are_exchanged(stage: mh.Stage, controller: mh.control.HybridController) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ours:
        ours.bind(("127.0.0.1", 0))
        ours.settimeout(10.0)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
            free.bind(("127.0.0.1", 0))
            local = free.getsockname()
        simulated = plant(stage)
        drives: list[float] = []

        def serve() -> None:
            while not drives or drives[-1] != REST["rest_drive"]:
                data, sender = ours.recvfrom(64)
                number, drive = struct.unpack("<Qd", data)
                drives.append(drive)
                ours.sendto(struct.pack("<Qd", number, simulated.step(drive)), sender)

        thread = threading.Thread(target=serve)
        thread.start()
        io = mh.realtime.Udp(f"127.0.0.1:{ours.getsockname()[1]}", local=f"127.0.0.1:{local[1]}")
        report = mh.realtime.run(controller, io, sine(), **REST, seconds=0.3, watchdog=(0.01, 10.0))
        thread.join()
    assert (report.end, report.at_rest, drives[-1]) == ("time_over", True, -10.0)
    everything = report.to_dict()
    assert everything["counts"]["fresh"] > 0
    assert everything["datagrams"]["received"] >= everything["counts"]["fresh"]
    assert sum(everything["datagrams"].values()) == everything["datagrams"]["received"]
    assert [one for one in report.warnings if not one.startswith("controller: ")] == []


def test_an_amplifier_with_narrower_limits_is_refused(
    controller: mh.control.HybridController,
) -> None:
    low, high = controller.limits

    class Amplifier:
        limits: object = (low, high)

        def read(self) -> float:
            return 0.0

        def write(self, drive: float) -> None:
            assert low <= drive <= high

    io = Amplifier()
    mh.realtime.run(controller, io, sine(), **REST, seconds=0.01)
    holds = f"io.limits: expected limits that hold those of the controller, ({low}, {high}), got ("
    for limits, said in [
        ((low, 0.9 * high), holds),
        ((0.9 * low, high), holds),
        ((high, low), "io.limits: expected (low, high) with low below high, got"),
        ("wide", "io.limits: expected two numbers (low, high) or None, got"),
    ]:
        io.limits = limits
        with pytest.raises((ValueError, TypeError), match=re.escape(said)):
            mh.realtime.run(controller, io, sine(), **REST, seconds=0.01)


def test_without_datagrams_none_are_counted(
    stage: mh.Stage, controller: mh.control.HybridController
) -> None:
    report = mh.realtime.run(controller, plant(stage), sine(), **REST, seconds=0.01)
    assert report.to_dict()["datagrams"] is None


def test_memory_is_shared(controller: mh.control.HybridController, tmp_path: Path) -> None:
    path = tmp_path / "stage"
    io = mh.realtime.SharedMemory(path)
    report = mh.realtime.run(controller, io, sine(), **REST, watchdog=(0.0, 0.05))
    assert (report.end, report.at_rest) == ("watchdog", True)
    memory = path.read_bytes()
    assert memory[:8] == b"MPIHYST1"
    lock, number, drive = struct.unpack_from("=QQd", memory, 128)
    assert (lock, number, drive) == (2 * report.taken, report.taken - 1, -10.0)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"rest_drive": 900.0}, "rest_drive: expected a drive within the limits"),
        ({"rest_rate": -1.0}, "rest_rate: expected a rate above 0"),
        ({"rate": 999.0}, "rate: expected 1000.0, as the controller has, got 999.0"),
        ({"controller": STAGE, "rate": 1e7}, "rate: expected 0.1 to 1e6 samples per second, got 1"),
        (
            {"controller": STAGE, "rate": 999.0},
            "rate: expected 1000.0, for which the Plant that is `io` was made, got 999.0",
        ),
        (
            {"controller": SLOW, "rate": 1e4, "io": Bench(STAGE)},
            "rate: its sampling interval 1 / rate: expected at least 1e-5 of 1 / (2 pi f)",
        ),
        ({"misses": "ignore"}, 'misses: expected "skip", "catch_up" or "stop", got "ignore"'),
        ({"misses": 3}, 'misses: expected "skip", "catch_up" or "stop", got 3'),
        ({"repeat": "yes"}, "repeat: expected True or False, got 'yes'"),
        ({"lock_memory": "yes"}, "lock_memory: expected True or False, got 'yes'"),
        ({"record": 3}, "record: expected the path of a file, got 3"),
        ({"record": ""}, "record: expected the path of a file, got ''"),
        ({"record": "x\0"}, "record: expected the path of a file, got 'x\\x00'"),
        ({"stop": 3}, "stop: expected a Stop or None, got 3"),
        ({"most_caught_up": 3}, 'most_caught_up: expected None without misses="catch_up"'),
        ({"watchdog": (1.0, 0.5)}, "watchdog: expected a time from 0 to rest_after"),
        ({"watchdog": (0.0, 0.0)}, "watchdog: expected a time from the sampling interval"),
        ({"watchdog": 1.0}, "watchdog: expected two numbers"),
        ({"fifo": 100}, "fifo: expected a priority from 1 to 99, got 100\n"),
        ({"fifo": 1000}, "fifo: expected a priority from 1 to 99, got 1000"),
        ({"most_write_faults": 0}, "most_write_faults: expected a whole number from 1, got 0\n"),
        (
            {"most_write_faults": 2**40},
            "most_write_faults: expected a whole number from 1 to 42949",
        ),
        ({"progress": 3}, "progress: expected a callable or None, got 3"),
        ({"controller": STAGE, "rate": 0.0}, "rate: expected 0.1 to 1e6 samples per second, got 0"),
        ({"seconds": 0.0}, "seconds: expected a time"),
        ({"reference": []}, "reference: "),
        ({"io": 3}, "io: expected a Plant, Functions, Udp, SharedMemory, or an object"),
        ({"controller": 3}, "controller: expected a HybridController or a Stage, got 3"),
    ],
)
def test_what_cannot_be_is_refused_by_its_name(
    stage: mh.Stage,
    controller: mh.control.HybridController,
    wrong: dict[str, Any],
    message: str,
) -> None:
    given = {"controller": controller, "io": plant(stage), "reference": sine(), **REST, **wrong}
    with pytest.raises((ValueError, TypeError)) as caught:
        mh.realtime.run(**given)
    assert f"{caught.value}\n".startswith(message)
    assert getattr(caught.value, "parameter", None) == message.split(":")[0]
    assert controller.drive == 0.0


@pytest.mark.parametrize("wrong", [{"plant": 3}, {"local": None}])
def test_what_is_no_address_is_named(wrong: dict[str, Any]) -> None:
    with pytest.raises(TypeError, match=r'^(plant|local): expected "host:port", got '):
        mh.realtime.Udp(**{"plant": "127.0.0.1:1", "local": "127.0.0.1:2", **wrong})


def test_what_is_read_and_no_number_is_named(
    stage: mh.Stage, controller: mh.control.HybridController
) -> None:
    bench = Bench(stage)
    bench.read = lambda: "x"  # type: ignore[method-assign, assignment, return-value]
    with pytest.raises(TypeError, match=r"^io\.read: expected a number or None, got 'x'") as caught:
        mh.realtime.run(controller, bench, sine(), **REST)
    report = caught.value.report  # type: ignore[attr-defined]
    assert (report.end, report.at_rest) == ("panicked", True)


def test_a_controller_that_is_too_fast_is_named() -> None:
    fast = mh.control.HybridController(None, kp=0.0, ki=1.0, dt=1e-7, limits=(-20.0, 20.0))
    said = "^controller: expected a sampling interval of the controller from 1e-6 to 10 seconds"
    with pytest.raises(ValueError, match=said):
        mh.realtime.run(fast, Bench(STAGE), sine(), **REST)
