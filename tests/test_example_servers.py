"""Examples that serve an axis to a control system: EPICS, bluesky and TANGO, all of them real."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from support_stage import DT, scanner, stage

EXAMPLES = Path(__file__).parents[1] / "examples"
pytestmark = [
    # Of the libraries: sockets and loops that they leave to the garbage collector.
    pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]


def followed(put_out: list[Any], axis: str) -> float:
    """Where a stage is that got all these drives."""
    reached = stage().forward(DT).run(np.concatenate([drives[axis] for drives in put_out]))
    return float(reached[-1])


# ---- EPICS

SERVER = """
import sys
import with_softioc
from support_stage import scanner
put_out = []
with_softioc.serve("MH", scanner(), put_out.append)
print("ready", flush=True)
sys.stdin.read()
print([[float(one) for one in drives["x"][-1:]] for drives in put_out], flush=True)
import os
os._exit(0)  # the threads of the IOC do not end
"""
CLIENT = """
import asyncio
from aioca import caget, caput

async def main():
    for wanted in (25.0, 20.0, 999.0):
        await caput("MH:X:GOTO", wanted, wait=True, timeout=30)
        await asyncio.sleep(0.5)
        print(repr(float(await caget("MH:X:POSITION", timeout=30))))
        print(bytes(await caget("MH:REFUSED", timeout=30)).rstrip(b"\\0").decode())
    await caput("MH:X:GOTO", 20.0, wait=True, timeout=30)
    await asyncio.sleep(0.5)
    print(repr(float(await caget("MH:Y:POSITION", timeout=30))))

asyncio.run(main())
"""


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


def test_an_ioc_moves_the_stage() -> None:
    pytest.importorskip("softioc", reason="LEFT OUT: softioc is not installed")
    pytest.importorskip("aioca", reason="LEFT OUT: aioca is not installed")
    environment = {
        **os.environ,
        **{"EPICS_CA_ADDR_LIST": "127.0.0.1", "EPICS_CA_AUTO_ADDR_LIST": "NO"},
        **{"EPICS_CAS_INTF_ADDR_LIST": "127.0.0.1", "EPICS_CA_SERVER_PORT": str(free_port())},
        "EPICS_CAS_BEACON_ADDR_LIST": "127.0.0.1",
        "PYTHONPATH": os.pathsep.join([str(EXAMPLES), os.environ.get("PYTHONPATH", "")]),
    }
    with subprocess.Popen(
        [sys.executable, "-c", SERVER],
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as server:
        try:
            assert server.stdout is not None
            assert any(line.strip() == "ready" for line in server.stdout)
            client = [sys.executable, "-c", CLIENT]
            said = subprocess.run(
                client, env=environment, capture_output=True, text=True, timeout=120, check=False
            )
            assert said.returncode == 0, said.stderr
            output, _ = server.communicate(timeout=30)
        finally:
            server.kill()
    lines = said.stdout.splitlines()
    assert [float(line) for line in lines[0::2][:3]] == pytest.approx([25.0, 20.0, 20.0], abs=1e-6)
    assert lines[1] == lines[3] == "" and "positions that the stage reaches" in lines[5]
    assert float(lines[6]) == 0.0
    assert output.count("[") == 4  # three motions: what was refused did not move


# ---- bluesky


def test_a_plan_of_bluesky_moves_the_stage() -> None:
    pytest.importorskip("ophyd_async", reason="LEFT OUT: ophyd-async is not installed")
    bp = pytest.importorskip("bluesky.plans", reason="LEFT OUT: bluesky is not installed")
    import with_bluesky
    from bluesky import RunEngine
    from bluesky.utils import FailedStatus
    from ophyd_async.core import init_devices

    put_out: list[Any] = []
    seen: list[float] = []
    engine = RunEngine()
    one = scanner()
    with init_devices():
        axis = with_bluesky.PiezoAxis(one, "x", put_out.append, name="piezo")

    def keep(name: str, document: dict[str, Any]) -> None:
        if name == "event":
            seen.append(document["data"]["piezo-position"])

    engine(bp.scan([], axis, 20.0, 40.0, 5), keep)
    np.testing.assert_allclose(seen, np.linspace(20.0, 40.0, 5), rtol=0.0, atol=1e-6)
    assert len(put_out) == 5 and followed(put_out, "x") == pytest.approx(40.0, abs=0.05)
    before = one.state
    with pytest.raises(FailedStatus):
        engine(bp.scan([], axis, 40.0, 400.0, 2), keep)
    assert seen[-1] == pytest.approx(40.0, abs=1e-6) and len(put_out) == 6
    one.state = before  # it is one that the scanner takes


# ---- TANGO


def test_a_tango_device_moves_the_stage_and_remembers(tmp_path: Path) -> None:
    tango = pytest.importorskip("tango", reason="LEFT OUT: PyTango is not installed")
    import with_tango
    from tango.test_context import DeviceTestContext

    memory = str(tmp_path / "scanner.json")
    options: dict[str, Any] = {"properties": {"memory": memory}, "process": True, "timeout": 60}
    with DeviceTestContext(with_tango.PiezoScanner, **options) as device:
        device.x = 25.0
        assert device.x == pytest.approx(25.0, abs=1e-6)
        device.y = 10.0
        # x keeps its drive meanwhile, and creeps.
        before = device.x, device.y
        assert before == pytest.approx((25.0, 10.0), abs=0.1) and before[0] > 25.01
        with pytest.raises(tango.DevFailed, match="positions that the stage reaches"):
            device.x = 999.0
        assert (device.x, device.y) == before
    with DeviceTestContext(with_tango.PiezoScanner, **options) as device:
        assert (device.x, device.y) == before
    one = mh.scan.Scanner({"x": stage(), "y": stage()}, DT)
    one.load(memory)
    assert (one.positions["x"], one.positions["y"]) == before
