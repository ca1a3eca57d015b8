"""`mpi-hyst realtime`: its summary, what it writes, and its errors."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import mpi_hyst as mh
import numpy as np
import pytest
from commands import assert_refused, names_in, run, write_csv

FILES = {"stage.json", "reference.csv"}
REALTIME = ["realtime", "stage.json", "--rate", "1000", "--seconds", "0.2"]


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    mh.paper.plant("A1").stage.replace(slew=2e4).save(tmp_path / "stage.json")
    write_csv(tmp_path / "reference.csv", "target_um", [[0.01 * k] for k in range(100)])
    return tmp_path


def test_it_says_what_the_loop_did(here: Path) -> None:
    more = ["--reference", "reference.csv", "-o", "x.npy", "--json", "x.json", "--plot", "x.png"]
    result = run(*REALTIME, *more)
    assert result.exit_code == 0, result.output
    assert result.stderr == ""
    report, record = json.loads((here / "x.json").read_text()), np.load(here / "x.npy")
    assert (report["end"], report["at_rest"]) == ("time_over", True)
    assert len(record) == report["deadlines"]["taken"]
    first = record["reference"][:100]
    np.testing.assert_allclose(np.diff(first), 0.01 * np.diff(np.rint(100 * first)), atol=1e-12)
    assert names_in(here) == FILES | {"x.npy", "x.json", "x.png"}
    for said in (
        "stage.json at 1000 Hz",
        "time over, at the rest drive",
        f"{report['deadlines']['taken']}, {report['deadlines']['skipped']} deadlines skipped",
        "p99.99",
        "written  x.npy",
        "written  x.png",
    ):
        assert said in result.stdout


def test_a_reference_is_made_that_stays_in_range(here: Path) -> None:
    result = run(*REALTIME, "-o", "x.npy", "--misses", "catch_up", "--rest", "5")
    assert result.exit_code == 0, result.output
    low, high = mh.paper.plant("A1").stage.position_range or (0.0, 0.0)
    record = np.load(here / "x.npy")
    assert low < record["reference"].min() < record["reference"].max() < high
    assert record["drive"][-1] == 5.0


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--rest", "900"], "--rest: expected a drive within the limits"),
        (["--rest-rate", "0"], "--rest-rate: expected a rate above 0"),
        (["--seconds", "0"], "--seconds: expected a time"),
        (["--watchdog", "2,1"], "--watchdog: expected a time from 0 to rest_after"),
        (["--fifo", "100"], "--fifo: expected a priority from 1 to 99"),
        (["--fifo", "x"], "expected a priority from 1 to 99, got 'x'"),
        (["--rate", "0"], "--rate: expected a finite number above 0, got 0.0"),
        (["--rate", "nan"], "--rate: expected a finite number above 0, got nan"),
        (["--rate", "1e9"], "--rate: expected 0.1 to 1e+06 samples per second, got 1e+09"),
        (["--slew", "0"], "--slew: expected"),
        (["--slew", "1e7"], "--slew: expected at most 20000, which stage.json allows, got 1e+07"),
        (["--shared-memory", "stage.json"], "stage.json: is an input file"),
        (["--shared-memory", "m", "-o", "m"], "m: named for two outputs"),
        (["--shared-memory", "reference.csv"], "reference.csv: expected a new or empty file"),
        (["--udp", "here", "--local", "127.0.0.1:0"], '--udp: expected "host:port", got "here"'),
        (["--udp", "127.0.0.1:1", "--local", "x"], '--local: expected "host:port", got "x"'),
        (["--udp", "127.0.0.1:1", "--local", "192.0.2.1:9"], "--udp: 127.0.0.1:1 from 192.0.2.1:9"),
        (["--udp", "127.0.0.1:1"], "--local: expected HOST:PORT beside --udp"),
        (
            ["--udp", "127.0.0.1:1", "--local", "127.0.0.1:0", "--shared-memory", "m"],
            "--udp: expected none beside --shared-memory",
        ),
        (["--reference", "none.csv"], "none.csv"),
        (["-o", "stage.json"], "stage.json: is an input file"),
        (["--plot", "x.tiff"], "--plot: expected a name that ends in .svg, .png or .pdf"),
    ],
)
def test_what_cannot_be_is_refused(here: Path, more: list[str], said: str) -> None:
    before = {name: (here / name).read_bytes() for name in FILES}
    assert_refused(run(*REALTIME, *more), here, FILES, said)
    assert {name: (here / name).read_bytes() for name in FILES} == before


def test_times_of_another_rate_are_refused(here: Path) -> None:
    for dt in (0.001, 0.002):
        write_csv(here / "timed.csv", "time_s,target_um", [[dt * k, 0.01 * k] for k in range(100)])
        result = run(*REALTIME, "--reference", "timed.csv")
        if dt == 0.001:
            assert result.exit_code == 0, result.output
            continue
        said = "timed.csv: time_s: expected the times of --rate 1000, got one sample each 0.002 s"
        assert_refused(result, here, FILES | {"timed.csv"}, said, "(--rate 500)")


def test_a_priority_is_not_the_file(here: Path) -> None:
    said = "expected a priority from 1 to 99, got 'stage.json'; without one put --fifo behind"
    assert_refused(run("realtime", "--fifo", "stage.json"), here, FILES, said)


def test_what_may_surprise_is_said_before(here: Path) -> None:
    actuator = mh.paper.plant("A1").stage
    warm = actuator.replace(temperature=mh.plant.TemperatureTerm(0.02, 60.0, 23.0))
    warm.save(here / "stage.json")
    result = run(*REALTIME, "--rest-rate", "20", "--seconds", "0.05", "--rest", "0.001")
    assert result.exit_code == 0
    steady, first, second = result.stderr.splitlines()
    assert steady == (
        "mpi-hyst: note: stage.json: follows a temperature, which is taken to stay at 23"
    )
    actuator.save(here / "stage.json")
    assert first == (
        "mpi-hyst: note: stage.json has no slew rate: the drive may jump from limit to limit in "
        "one sample; --slew bounds it"
    )
    assert second.startswith("mpi-hyst: note: going to rest may take 5")
    result = run(*REALTIME, "--slew", "1e4", "-o", "x.npy")
    assert (result.exit_code, result.stderr) == (0, "")
    assert np.abs(np.diff(np.load(here / "x.npy")["drive"], prepend=0.0)).max() <= 1e4 / 1000


@pytest.mark.filterwarnings("ignore:dead_time")
def test_warnings_of_identification_are_said(here: Path) -> None:
    drive = mh.signals.decaying_triangle(100.0, 1.0, cycles=5, rate=1000)
    position = mh.paper.table_1_recovered().forward().run(drive)
    # Without a sampling interval a stage has no dead time, which is a warning.
    found = mh.identify(drive, position, operators=4, dead_time=2)
    warnings = (found.stage.identified or {})["warnings"]
    assert len(warnings) >= 2
    found.stage.replace(limits=(-90.0, 90.0), slew=2e4).save(here / "stage.json")
    result = run(*REALTIME, "--seconds", "0.05")
    assert result.exit_code == 0
    assert result.stderr == "".join(
        f"mpi-hyst: note: stage.json: {one['severity']}: {one['message']}\n" for one in warnings
    )


def test_the_status_says_that_something_else_ended_it(here: Path) -> None:
    nobody = ["--udp", "127.0.0.1:9", "--local", "127.0.0.1:0"]
    result = run(*REALTIME, *nobody, "--json", "x.json")
    assert result.exit_code == 3
    report = json.loads((here / "x.json").read_text())
    assert report["end"] == "watchdog"
    assert "watchdog, at the rest drive" in result.stdout
    refused = report["datagrams"]["refused"]
    assert refused > 0
    assert f"0 received, 0 lost, 0 late, 0 malformed, {refused} refused" in result.stdout
    assert "warning: io: the rest drive may have reached nobody: it was sent" in result.stdout


def test_the_status_says_that_the_rest_drive_may_have_reached_nobody(here: Path) -> None:
    # Over before the watchdog's time is.
    nobody = ["--udp", "127.0.0.1:9", "--local", "127.0.0.1:0", "--seconds", "0.03"]
    result = run(*REALTIME, *nobody, "--json", "x.json")
    report = json.loads((here / "x.json").read_text())
    assert (report["end"], report["at_rest"]) == ("time_over", True)
    assert report["rest_refused"] > 0
    assert result.exit_code == 3


@pytest.mark.usefixtures("here")
def test_what_the_loop_did_is_said_where_it_cannot_be_written(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def full(path: Path, _: object) -> None:
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr("mpi_hyst._cli.outputs.write_file", full)
    result = run(*REALTIME, "--json", "x.json", "-o", "x.npy")
    assert result.exit_code == 2
    assert result.stderr == "mpi-hyst: error: x.json: No space left on device\n"
    assert "time over, at the rest drive" in result.stdout and "written  x.npy" in result.stdout


def test_a_figure_that_cannot_be_drawn_leaves_the_report(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> bytes:
        raise RuntimeError("no figure")

    monkeypatch.setattr("mpi_hyst._report.canvas.image", broken)
    with pytest.raises(RuntimeError, match="no figure"):
        run(*REALTIME, "--json", "x.json", "--plot", "x.png")
    assert json.loads((here / "x.json").read_text())["at_rest"]


@pytest.mark.skipif(os.name == "nt", reason="no limit on the size of files")
def test_a_record_that_could_not_be_written_is_told(here: Path) -> None:
    import resource

    done = subprocess.run(
        [sys.executable, "-m", "mpi_hyst._cli", *REALTIME, "-o", "x.npy"],
        capture_output=True,
        text=True,
        check=False,
        # The header fits, the first rows do not.
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (290, 290)),
    )
    assert done.returncode == 3, done.stderr
    assert "rows are missing: File too large" in done.stdout
    assert "written" not in done.stdout
    assert names_in(here) == FILES


@pytest.mark.skipif(os.name == "nt", reason="signals")
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_signal_ends_the_loop_and_loses_nothing(here: Path, name: str) -> None:
    number = getattr(signal, name)
    more = ["--seconds", "600", "-o", "x.npy", "--json", "x.json", "--plot", "x.png"]
    with subprocess.Popen(
        [sys.executable, "-m", "mpi_hyst._cli", *REALTIME, *more],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # A program that was started in the background ignores Ctrl-C.
        preexec_fn=lambda: [signal.signal(one, signal.SIG_DFL) for one in (2, 1, 15)],
    ) as running:
        # The record is there when the first samples are.
        while not (here / "x.npy").exists():
            assert running.poll() is None
            time.sleep(0.01)
        # Also while it goes to rest, while files are drawn and written, and while Python ends.
        while running.poll() is None:
            running.send_signal(number)
            time.sleep(0.02)
        said, errors = running.communicate()
    assert (running.returncode, errors) == (0, "")
    report = json.loads((here / "x.json").read_text())
    assert (report["end"], report["at_rest"]) == ("requested", True)
    assert "requested, at the rest drive" in said and "written  x.png" in said
    assert names_in(here) == FILES | {"x.npy", "x.json", "x.png"}
