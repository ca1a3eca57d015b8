"""Examples that drive devices: real libraries, with fake devices behind them."""

from __future__ import annotations

import socketserver
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar
from unittest.mock import create_autospec

import mpi_hyst as mh
import numpy as np
import pytest
import with_qudi
from support_stage import DT, scanner, stage

RASTER = {
    "x": 20.0 + mh.signals.triangle(10.0, 2.0, seconds=0.5, rate=1.0 / DT),
    "y": np.linspace(20.0, 25.0, 500),
}


ORDER = ("write_analog_f64", "start_task", "wait_until_task_done", "clear_task")


def told(capsys: pytest.CaptureFixture[str], what: str) -> None:
    """Say it on the terminal, whatever pytest captures."""
    with capsys.disabled():
        print(f"\nFAKE DEVICE: {what}")  # noqa: T201


# ---- NI-DAQmx


def driver(written: list[Any]) -> Any:
    """What nidaqmx calls instead of the driver: it notes every call and keeps what is written."""
    from nidaqmx._base_interpreter import BaseInterpreter

    made = create_autospec(BaseInterpreter, instance=True)
    made.create_task.return_value = ("task", True)  # a handle, and whether it is to be closed
    made.get_task_attribute_string.return_value = "scan"
    made.internal_get_last_created_chan.return_value = "Dev1/ao0"
    made.get_write_attribute_uint32.return_value = 2  # channels

    def write(_: str, samples: int, start: bool, timeout: float, layout: int, data: Any) -> int:
        assert not start and timeout > 0.0 and data.shape == (2, samples)
        assert layout == 0 and data.flags.c_contiguous  # channel by channel
        written.append(data.copy())
        return samples

    made.write_analog_f64.side_effect = write
    return made


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_nidaqmx_puts_out_every_axis(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    nidaqmx = pytest.importorskip("nidaqmx", reason="LEFT OUT: nidaqmx is not installed")
    import with_nidaqmx

    told(capsys, "the package nidaqmx is real, the driver NI-DAQmx below it is not")
    written: list[Any] = []
    below = driver(written)
    monkeypatch.setattr(nidaqmx.utils, "_select_interpreter", lambda *_: below)
    one, expected = scanner(), scanner().run(RASTER, lead_in=0.1)
    assert with_nidaqmx.put_out(one, RASTER, {"y": "Dev1/ao0", "x": "Dev1/ao1"}) == 600
    np.testing.assert_array_equal(written[0], [expected["y"], expected["x"]])
    channels = [call.args[1:5] for call in below.create_ao_voltage_chan.call_args_list]
    assert channels == [("Dev1/ao0", "", 0.0, 10.0), ("Dev1/ao1", "", 0.0, 10.0)]
    _, rate, _, _, mode, samples = below.cfg_samp_clk_timing.call_args.args
    assert (rate, samples) == (1.0 / DT, 600)
    assert mode == nidaqmx.constants.AcquisitionType.FINITE.value
    order = [call[0] for call in below.method_calls if call[0] in ORDER]
    assert order == list(ORDER)


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize(("fails", "done"), [("start_task", 0), ("wait_until_task_done", 150)])
def test_of_a_scan_that_breaks_off_what_was_put_out_counts(
    fails: str, done: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    nidaqmx = pytest.importorskip("nidaqmx", reason="LEFT OUT: nidaqmx is not installed")
    import with_nidaqmx

    below = driver([])
    getattr(below, fails).side_effect = OSError("the cable is off")
    below.get_write_attribute_uint64.return_value = 150  # samples generated
    monkeypatch.setattr(nidaqmx.utils, "_select_interpreter", lambda *_: below)
    one, expected = scanner(), scanner()
    drives = scanner().run(RASTER, lead_in=0.1)
    expected.follow({axis: drive[:done] for axis, drive in drives.items()})
    with pytest.raises(OSError, match="the cable is off"):
        with_nidaqmx.put_out(one, RASTER, {"x": "Dev1/ao0", "y": "Dev1/ao1"})
    assert one.state == expected.state and below.clear_task.called


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
    with pipython.GCSDevice(gateway=PISocket(*controller)) as device:
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
    reached = bench.run(np.concatenate([drives["z"] for drives in put_out]))
    assert core.getPosition() == pytest.approx(20.0, abs=1e-6)
    assert reached[-1] == pytest.approx(20.0, abs=0.05)
    core.setOrigin()
    assert core.getPosition() == 0.0
    with pytest.raises(Exception, match="positions that the stage reaches"):
        core.setPosition(500.0)
