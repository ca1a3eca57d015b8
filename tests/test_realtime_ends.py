"""How a loop from Python ends: asked from outside, by a fault, and where it may not even start."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest

RATE = 1000.0
SLEW = 2e4  # V/s
REST: dict[str, Any] = {"rest_drive": -10.0, "rest_rate": 5e3}
REFERENCE = [0.5] * 100
SIGNALS = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]


@pytest.fixture(scope="module")
def stage() -> mh.Stage:
    return mh.paper.plant("A1").stage.replace(slew=SLEW)


@pytest.fixture
def controller(stage: mh.Stage) -> mh.control.HybridController:
    return stage.controller(1 / RATE)


class Amplifier:
    """What was written, with what each write does."""

    def __init__(self) -> None:
        self.drives: list[float] = []

    def read(self) -> float | None:
        return 0.0

    def write(self, drive: float) -> None:
        self.drives.append(drive)


def program(code: str, folder: Path, number: int = 0) -> subprocess.CompletedProcess[str]:
    """Run lines as a program of their own in a folder, with the names of this file."""
    lines = f"""
import os
import signal
import sys
import time
sys.path.insert(0, {str(Path(__file__).parent)!r})
import mpi_hyst as mh
from test_realtime_ends import RATE, REFERENCE, REST, SLEW, Amplifier
number = {number}
controller = mh.paper.plant("A1").stage.replace(slew=SLEW).controller(1 / RATE)
{code}"""
    return subprocess.run(
        [sys.executable, "-c", lines], capture_output=True, text=True, check=False, cwd=folder
    )


def test_another_thread_ends_it(controller: mh.control.HybridController) -> None:
    amplifier, stop = Amplifier(), mh.realtime.Stop()

    def read() -> float:
        # The thread of the loop.
        if len(amplifier.drives) == 50:
            stop.request()
        return 0.0

    amplifier.read = read  # type: ignore[method-assign]
    report = mh.realtime.run(controller, amplifier, REFERENCE, **REST, stop=stop)
    assert (report.end, report.at_rest, stop.is_requested) == ("requested", True, True)
    assert amplifier.drives[-1] == -10.0
    # It stays requested.
    again = mh.realtime.run(
        mh.paper.plant("A1").stage, Amplifier(), REFERENCE, **REST, rate=RATE, stop=stop
    )
    assert again.end == "requested" and again.taken == again.to_dict()["counts"]["rest_samples"]


@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_that_ends_a_program_ends_the_loop_and_then_the_program(
    tmp_path: Path, number: int
) -> None:
    done = program(
        """
def progress(shown):
    if shown["taken"] > 0:
        signal.raise_signal(number)

signal.signal(number, signal.SIG_DFL)
amplifier = Amplifier()
mh.realtime.run(controller, amplifier, REFERENCE, **REST, progress=progress, record="x.npy")
print("went on")
""",
        tmp_path,
        number=number,
    )
    assert (done.returncode, done.stdout, done.stderr) == (-number, "", "")
    assert np.load(tmp_path / "x.npy")["drive"][-1] == REST["rest_drive"]


def test_a_record_is_where_it_was_asked_for(tmp_path: Path) -> None:
    done = program(
        """
class Wanderer(Amplifier):
    def read(self):
        os.chdir("/")
        return 0.0

mh.realtime.run(controller, Wanderer(), REFERENCE, **REST, record="x.npy", seconds=0.2)
""",
        tmp_path,
    )
    assert done.returncode == 0, done.stderr
    assert [one.name for one in tmp_path.iterdir()] == ["x.npy"]


@pytest.mark.skipif(os.name == "nt", reason="no limit on the size of files")
@pytest.mark.parametrize("some", [False, True])
def test_the_report_has_as_many_rows_as_the_record(tmp_path: Path, some: bool) -> None:
    done = program(
        f"""
import resource

def read():
    # From the first rows on the file has no room for more of them; or already for one row behind
    # the header of 256 bytes.
    if {some} <= os.path.exists("x.npy"):
        resource.setrlimit(resource.RLIMIT_FSIZE, (290, resource.RLIM_INFINITY))
    return 0.0

amplifier = Amplifier()
amplifier.read = read
report = mh.realtime.run(controller, amplifier, REFERENCE, **REST, record="x.npy", seconds=0.5)
print(report.to_dict()["recorded_rows"], report.to_dict()["counts"]["lost_rows"], report.taken)
print(*(one for one in report.warnings if one.startswith("record: ")), sep="\\n")
""",
        tmp_path,
    )
    assert done.returncode == 0, done.stderr
    counted, warning = done.stdout.splitlines()
    rows, lost, taken = map(int, counted.split())
    assert rows == (len(np.load(tmp_path / "x.npy")) if some else 0)
    assert (rows > 0, rows + lost) == (some, taken)
    assert warning.startswith(f"record: {lost} rows are missing: File too large")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_a_child_does_not_keep_a_shared_memory(tmp_path: Path) -> None:
    done = program(
        """
children = []

def progress(shown):
    if not children:
        children.append(os.fork())
        if children == [0]:
            time.sleep(60)
            os._exit(0)

io = mh.realtime.SharedMemory("memory")
try:
    REST |= {"seconds": 0.4, "watchdog": None}
    mh.realtime.run(controller, io, REFERENCE, **REST, progress=progress)
    controller.hold = False
    mh.realtime.run(controller, io, REFERENCE, **REST)
finally:
    os.kill(children[0], signal.SIGKILL)
""",
        tmp_path,
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.skipif(sys.platform != "linux", reason="memory is locked on Linux alone")
def test_what_the_program_had_locked_stays_locked(tmp_path: Path) -> None:
    done = program(
        """
import ctypes
import pathlib
page = ctypes.create_string_buffer(100)
if ctypes.CDLL(None).mlock(page, 100) == 0:
    options = {"lock_memory": True, "seconds": 0.1}
    mh.realtime.run(controller, Amplifier(), REFERENCE, **REST, **options)
    status = pathlib.Path("/proc/self/status").read_text()
    assert "VmLck:\t       0 kB" not in status
""",
        tmp_path,
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("number", SIGNALS)
@pytest.mark.parametrize("refused", ["read", "record"])
def test_a_signal_ends_the_program_also_where_the_loop_could_not_begin(
    tmp_path: Path, refused: str, number: int
) -> None:
    done = program(
        f"""
class Broken(Amplifier):
    @property
    def read(self):
        signal.raise_signal(number)
        return None if {refused!r} == "read" else lambda: 0.0

signal.signal(number, signal.SIG_DFL)
amplifier = Broken()
mh.realtime.run(controller, amplifier, REFERENCE, **REST, record="no/x.npy")
""",
        tmp_path,
        number=number,
    )
    assert (done.returncode, done.stdout, done.stderr) == (-number, "", "")


def test_ctrl_c_where_the_loop_could_not_begin_is_raised(tmp_path: Path) -> None:
    done = program(
        """
import ctypes
import operator

# Compiled functions alone: Python looks at the signal no sooner than handlers are restored.
interrupt = ctypes.pythonapi.PyErr_SetInterruptEx
interrupt.restype = operator.itemgetter

class Broken:
    _as_parameter_ = int(signal.SIGINT)
    read = property(interrupt)
    write = print

signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGTERM, signal.SIG_DFL)
try:
    mh.realtime.run(controller, Broken(), REFERENCE, **REST, record="no/x.npy")
except KeyboardInterrupt:
    print("interrupted", signal.getsignal(signal.SIGTERM).name)
""",
        tmp_path,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "interrupted SIG_DFL\n", "")


@pytest.mark.parametrize("number", SIGNALS)
def test_a_handler_of_the_program_stays(
    controller: mh.control.HybridController, number: int
) -> None:
    called: list[int] = []

    def progress(_: dict[str, Any]) -> None:
        signal.raise_signal(number)

    before = signal.signal(number, lambda number, _: called.append(number))
    try:
        report = mh.realtime.run(
            controller, Amplifier(), REFERENCE, **REST, seconds=0.3, progress=progress
        )
    finally:
        signal.signal(number, before)
    assert (report.end, called[0]) == ("time_over", number)


def test_what_is_raised_says_where_the_drive_is(controller: mh.control.HybridController) -> None:
    amplifier = Amplifier()

    def write(drive: float) -> None:
        if len(amplifier.drives) == 20:
            raise OSError("broken")
        amplifier.drives.append(drive)

    amplifier.write = write  # type: ignore[method-assign]
    with pytest.raises(OSError, match="broken") as caught:
        mh.realtime.run(controller, amplifier, REFERENCE, **REST, most_write_faults=5)
    report = caught.value.report  # type: ignore[attr-defined]
    assert (report.end, report.at_rest) == ("write_failed", False)
    assert report.last_drive == amplifier.drives[-1] == controller.drive
    if sys.version_info >= (3, 11):
        (note,) = caught.value.__notes__
        assert note == (
            "the loop ended NOT at rest, the last drive that was written is "
            f"{amplifier.drives[-1]!r}"
        )


def test_what_is_raised_at_rest_says_so(controller: mh.control.HybridController) -> None:
    amplifier = Amplifier()

    def read() -> float:
        raise RuntimeError("no light on the sensor")

    amplifier.read = read  # type: ignore[method-assign]
    with pytest.raises(RuntimeError, match="no light") as caught:
        mh.realtime.run(controller, amplifier, REFERENCE, **REST)
    report = caught.value.report  # type: ignore[attr-defined]
    assert (report.end, report.at_rest, report.last_drive) == ("panicked", True, -10.0)


def test_a_controller_that_rests_is_refused(controller: mh.control.HybridController) -> None:
    mh.realtime.run(controller, Amplifier(), REFERENCE, **REST, seconds=0.05)
    for mode in ("stop", "hold"):
        said = "^controller: expected one that moves: set its `hold` to False, got one in mode "
        with pytest.raises(ValueError, match=f'{said}"{mode}"$') as caught:
            mh.realtime.run(controller, Amplifier(), REFERENCE, **REST, seconds=0.1)
        assert caught.value.parameter == "controller"  # type: ignore[attr-defined]
        controller.hold = False
        controller.hold = True
    controller.hold = False
    amplifier = Amplifier()
    mh.realtime.run(controller, amplifier, REFERENCE, **REST, seconds=0.1)
    assert np.ptp(amplifier.drives) > 0.0


def test_a_read_that_does_not_return_is_seen(controller: mh.control.HybridController) -> None:
    amplifier, seen = Amplifier(), [0.0]

    def read() -> float:
        if len(amplifier.drives) == 20:
            amplifier.drives.append(amplifier.drives[-1])
            # Until it was seen, or the test has failed.
            end = time.monotonic() + 20.0
            while max(seen) < 0.3 and time.monotonic() < end:
                time.sleep(0.01)
        return 0.0

    amplifier.read = read  # type: ignore[method-assign]
    mh.realtime.run(
        *(controller, amplifier, REFERENCE),
        **REST,
        seconds=0.2,
        watchdog=(0.0, 60.0),
        progress=lambda shown: seen.append(shown["waiting"]),
    )
    assert max(seen) >= 0.3


@pytest.mark.skipif(os.name == "nt", reason="pipes")
def test_a_pipe_is_no_record(tmp_path: Path) -> None:
    # In a process of its own: a pipe that nobody reads would hold it for ever.
    code = """
import sys
import mpi_hyst as mh
stage = mh.paper.plant("A1").stage
rest = {"rest_drive": 0.0, "rest_rate": 5e3, "rate": 1e3, "record": sys.argv[1]}
try:
    mh.realtime.run(stage, stage.plant(1e-3), [0.5], **rest)
except OSError as error:
    print(error)
"""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    done = subprocess.run(
        [sys.executable, "-c", code, str(pipe)],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.stdout == f"{pipe}: is not a regular file\n", done.stderr


def test_a_memory_is_that_of_one_loop(
    stage: mh.Stage, controller: mh.control.HybridController, tmp_path: Path
) -> None:
    stage.save(tmp_path / "stage.json")
    content = (tmp_path / "stage.json").read_bytes()
    said = "stage.json: expected a new or empty file, or one that begins with MPIHYST1"
    with pytest.raises(OSError, match=said):
        mh.realtime.run(
            controller, mh.realtime.SharedMemory(tmp_path / "stage.json"), REFERENCE, **REST
        )
    assert (tmp_path / "stage.json").read_bytes() == content
    memory, stop = mh.realtime.SharedMemory(tmp_path / "memory"), mh.realtime.Stop()
    arguments: dict[str, Any] = {**REST, "rate": RATE, "watchdog": None, "stop": stop}
    thread = threading.Thread(
        target=mh.realtime.run, args=(stage, memory, REFERENCE), kwargs=arguments
    )
    thread.start()
    try:
        while not memory.path.exists() or memory.path.read_bytes()[:8] != b"MPIHYST1":
            assert thread.is_alive()
            time.sleep(0.01)
        with pytest.raises(OSError, match="memory: another loop uses it"):
            mh.realtime.run(controller, memory, REFERENCE, **REST)
    finally:
        stop.request()
        thread.join()


@pytest.mark.parametrize("wrong", ["127.0.0.1", "127.0.0.1:x", ":47001", "127.0.0.1:70000", ""])
def test_what_is_no_address_is_refused_by_its_name(wrong: str) -> None:
    with pytest.raises(ValueError, match=r'^plant: expected "host:port", got'):
        mh.realtime.Udp(wrong, local="127.0.0.1:0")
    with pytest.raises(ValueError, match=r'^local: expected "host:port", got'):
        mh.realtime.Udp("127.0.0.1:1", local=wrong)
