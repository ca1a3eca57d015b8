"""Examples that drive devices: real libraries, with fake devices behind them."""

from __future__ import annotations

import socketserver
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import mpi_hyst as mh
import numpy as np
import pytest
import with_qudi
from support_stage import DT, scanner, stage

RASTER = {
    "x": 20.0 + mh.signals.triangle(10.0, 2.0, seconds=0.5, rate=1.0 / DT),
    "y": np.linspace(20.0, 25.0, 500),
}


def told(capsys: pytest.CaptureFixture[str], what: str) -> None:
    """Say it on the terminal, whatever pytest captures."""
    with capsys.disabled():
        print(f"\nFAKE DEVICE: {what}")  # noqa: T201


# ---- NI-DAQmx


class FakeStream:
    """What a writer of nidaqmx needs of the output of a task."""


class FakeTask:
    """A task without a device: it keeps what a real one would be told."""

    made: ClassVar[list[FakeTask]] = []
    fails = False

    def __init__(self) -> None:
        self.channels: list[tuple[str, float, float]] = []
        self.ao_channels = self.timing = self
        self.out_stream = FakeStream()
        self.calls: list[str] = []
        FakeTask.made.append(self)

    def __enter__(self) -> FakeTask:
        return self

    def __exit__(self, *_: object) -> None:
        self.calls.append("close")

    def add_ao_voltage_chan(self, name: str, *, min_val: float, max_val: float) -> None:
        self.channels.append((name, min_val, max_val))

    def cfg_samp_clk_timing(self, rate: float, *, sample_mode: Any, samps_per_chan: int) -> None:
        self.clock = rate, sample_mode.name, samps_per_chan

    def start(self) -> None:
        self.calls.append("start")

    def wait_until_done(self, timeout: float) -> None:
        assert timeout > 0.6
        if FakeTask.fails:
            raise OSError("the cable is off")
        self.calls.append("done")


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_nidaqmx_puts_out_every_axis(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("nidaqmx", reason="LEFT OUT: nidaqmx is not installed")
    import with_nidaqmx

    told(capsys, "the package nidaqmx is real, its Task is not: NI-DAQmx itself is not here")
    written: list[Any] = []

    class Writer:
        def __init__(self, stream: FakeStream) -> None:
            assert isinstance(stream, FakeStream)

        def write_many_sample(self, samples: Any) -> int:
            # What the real writer checks before it calls the driver.
            assert samples.flags.c_contiguous and samples.dtype == np.float64
            written.append(samples.copy())
            return int(samples.shape[1])

    monkeypatch.setattr(with_nidaqmx.nidaqmx, "Task", FakeTask)
    monkeypatch.setattr(with_nidaqmx, "AnalogMultiChannelWriter", Writer)
    one, expected = scanner(), scanner().run(RASTER, lead_in=0.1)
    channels = {"y": "Dev1/ao0", "x": "Dev1/ao1"}
    assert with_nidaqmx.put_out(one, RASTER, channels) == 600
    np.testing.assert_array_equal(written[0], [expected["y"], expected["x"]])
    task = FakeTask.made[-1]
    assert task.channels == [("Dev1/ao0", 0.0, 10.0), ("Dev1/ao1", 0.0, 10.0)]
    assert task.clock == (1.0 / DT, "FINITE", 600) and task.calls == ["start", "done", "close"]
    before = one.state
    monkeypatch.setattr(FakeTask, "fails", True)
    with pytest.raises(OSError, match="the cable is off"):
        with_nidaqmx.put_out(one, RASTER, channels)
    assert one.state == before


# ---- PIPython


class Controller(socketserver.StreamRequestHandler):
    """A controller of PI on a socket, as far as a wave table needs one."""

    log: ClassVar[list[str]] = []

    def handle(self) -> None:
        for line in self.rfile:
            command = line.decode("cp1252").strip()
            self.log.append(command)
            answer = self.answers().get(command)
            if answer is not None:
                self.wfile.write(answer.encode("cp1252"))

    @staticmethod
    def answers() -> dict[str, str]:
        return {"*IDN?": "PI, E-727.3SD, 0112345678, 1.0\n", "ERR?": "0\n", "CSV?": "2.0\n"}


@pytest.fixture
def controller() -> Iterator[tuple[str, int]]:
    Controller.log.clear()
    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), Controller) as server:
        server.daemon_threads = True
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield "127.0.0.1", server.server_address[1]
        finally:
            server.shutdown()
            thread.join()


# A device that is forgotten closes a socket that is closed.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")
def test_pipython_loads_the_wave_table(
    controller: tuple[str, int], capsys: pytest.CaptureFixture[str]
) -> None:
    pipython = pytest.importorskip("pipython", reason="LEFT OUT: PIPython is not installed")
    import with_pipython
    from pipython.pidevice.interfaces.pisocket import PISocket

    told(capsys, "PIPython is real and speaks over a socket, the controller behind it is not")
    drives = scanner().run({"x": RASTER["x"]}, lead_in=0.1)["x"]
    with PISocket(*controller) as gateway:
        device = pipython.GCSDevice(gateway=gateway)
        with_pipython.load_waveform(device, drives)
        with_pipython.start(device)
    points: list[float] = []
    for command in Controller.log:
        if command.startswith("WAV "):
            _, table, mode, kind, _, count, *values = command.split()
            assert (table, mode, kind) == ("1", "&" if points else "X", "PNT")
            assert int(count) == len(values)
            points += map(float, values)
    np.testing.assert_allclose(points, drives, rtol=1e-5)
    assert [one for one in Controller.log if one[:3] in ("WSL", "WGC", "WGO")] == [
        *("WSL 1 1", "WGC 1 1", "WGO 1 1"),
    ]


# ---- a scanner as of qudi


def test_a_scanner_like_that_of_qudi_goes_on_after_a_restart(tmp_path: Path) -> None:
    put_out: list[Any] = []
    memory = tmp_path / "memory.json"
    device = with_qudi.PiezoScanner(scanner(), put_out.append, memory)
    device.move_absolute({"x": 40.0, "y": 10.0})
    device.scan_line({"x": 40.0}, {"x": 20.0}, pixels=300)
    again = with_qudi.PiezoScanner(scanner(), put_out.append, memory)
    assert again.get_position() == device.get_position()
    again.scan_line({"x": 20.0}, {"x": 30.0}, pixels=300)
    bench = stage().forward(DT)
    reached = bench.run(np.concatenate([drives["x"] for drives in put_out]))
    line = reached[-300:]
    # The first samples catch up with the motion, which begins with a corner behind its run-up.
    assert np.abs(line - np.linspace(20.0, 30.0, 300)).max() < 0.05
    assert set(put_out[-1]["y"]) == {put_out[0]["y"][-1]}


def test_what_was_not_written_is_not_remembered(tmp_path: Path) -> None:
    def broken(_: object) -> None:
        raise OSError("no card")

    device = with_qudi.PiezoScanner(scanner(), broken, tmp_path / "memory.json")
    before = device.get_position()
    with pytest.raises(OSError, match="no card"):
        device.move_absolute({"x": 40.0})
    assert device.get_position() == before and not (tmp_path / "memory.json").exists()


# ---- pymmcore-plus


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")
def test_pymmcore_moves_the_stage() -> None:
    pytest.importorskip("pymmcore_plus", reason="LEFT OUT: pymmcore-plus is not installed")
    import with_pymmcore

    put_out: list[Any] = []
    one = mh.scan.Scanner({"z": stage()}, DT)
    core = with_pymmcore.core(one, put_out.append)
    core.setPosition(25.0)
    core.setRelativePosition(-5.0)
    bench = stage().forward(DT)
    reached = bench.run(np.concatenate(put_out))
    assert core.getPosition() == pytest.approx(20.0, abs=1e-6)
    assert reached[-1] == pytest.approx(20.0, abs=0.05)
    core.setOrigin()
    assert core.getPosition() == 0.0
    with pytest.raises(Exception, match="positions that the stage reaches"):
        core.setPosition(500.0)
