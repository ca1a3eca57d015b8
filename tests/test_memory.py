"""Where memory ends: a MemoryError, and the interpreter goes on."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

resource = pytest.importorskip("resource")

# A process that may have some more memory than its arrays take: each call in a fork of it.
PREPARED = """
import os, resource, sys
import numpy as np
import mpi_hyst as mh
from killed_saves import forked
M = mh.paper.table_1_recovered()
D = mh.plant.SecondOrder(400.0, 0.9)
S = mh.Stage(M, limits=(-500.0, 500.0), dynamics=D, slew=1e5)
C = S.controller(1e-4)
N = 1 << 24
BIG = np.zeros(N)
BIG[::2] = 0.001
TWICE = np.zeros(2 * N)
with open("/proc/self/statm") as pages:
    used = int(pages.read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + (200 << 20),) * 2)
resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

def call(work):
    try:
        work()
    except MemoryError:
        os._exit(0)
    os._exit(5)

for line in sys.argv[2:]:
    child = forked(lambda: call(lambda: eval(line)))
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    print(status, line)
"""
CALLS = [
    "mh.signals.multisine(1.0, [1, 2, 3], samples=1 << 24)",
    "mh.control.IterativeLearning(BIG, kp=0.0, ki=1.0, slope=1.0, dynamics=D, dt=1e-4)",
    "S.precompensate(BIG, 1e-4)",
    "M.forward().run(TWICE)",
    "M.forward().run(TWICE[:-1], out=TWICE[1:])",
    "S.inverse(1e-4).follow(TWICE)",
    "S.precompensate(BIG[:4], 1e-4, history=TWICE)",
    "mh.control.invert_dynamics(BIG, 1e-4, dynamics=D)",
    "mh.identify(BIG, BIG)",
    "mh.diagnose(BIG, BIG, M)",
    "mh.compare(BIG, BIG)",
    "mh.identify_dynamics(BIG, BIG, M, dt=1e-4)",
    "mh.identify_many(BIG, BIG.reshape(-1, 1))",
    "mh.plant.simulate(C, S.plant(1e-4), BIG)",
    "mh.plant.Run(BIG, BIG, BIG, BIG)",
    "mh.PrandtlIshlinskii(np.ones(1 << 20), np.arange(1 << 20))",
]


@pytest.mark.skipif(sys.platform != "linux", reason="reads what the process uses in /proc")
def test_what_needs_more_memory_than_there_is_raises() -> None:
    tests = str(Path(__file__).parent)
    code = "import sys; sys.path.insert(0, sys.argv[1])\n" + PREPARED
    command = [sys.executable, "-c", code, tests, *CALLS]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == [f"0 {call}" for call in CALLS], done.stderr[-2000:]


def test_a_range_is_not_made_a_list() -> None:
    import mpi_hyst as mh

    with pytest.raises(ValueError, match=r"^lines: expected at most 500 lines, half of the"):
        mh.signals.multisine(1.0, range(1, 10**12), samples=1000)
