"""Stages for other programs: headers of constants, bytes, and the command that writes them."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from commands import assert_refused, names_in, run
from fmpy.validation import validate_fmu
from mpi_hyst._core import read_bytes

DT = 1e-4
COMPILERS = [["cc", "-std=c99"], ["c++", "-std=c++11", "-x", "c++"]]
WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Werror"]

# A plain loop over the operators, and small steps of the Duhem operator, as the header says it.
PROGRAM = """
#include <stdio.h>
#include "axis.h"

#if AXIS_DUHEM_KNOTS
static double slope(const double *f, double z) {
    int i = 0, inside = axis_duhem_knots[0] <= z && z <= axis_duhem_knots[AXIS_DUHEM_KNOTS - 1];
    while (i < AXIS_DUHEM_KNOTS - 2 && z > axis_duhem_knots[i + 1]) i++;
    double from = axis_duhem_knots[i], to = axis_duhem_knots[i + 1], t = (z - from) / (to - from);
    double line = f[i] + t * (f[i + 1] - f[i]), end = t < 0.5 ? f[i] : f[i + 1];
    return inside || (line > end && end > 0.0) ? line : end;
}

static double moved(double z, double dx) {
    const double *f = dx > 0.0 ? axis_duhem_rising : axis_duhem_falling;
    double h = dx / 1000.0;
    for (int i = 0; i < 1000; i++) {
        double k1 = slope(f, z), k2 = slope(f, z + 0.5 * h * k1), k3 = slope(f, z + 0.5 * h * k2);
        z += h / 6.0 * (k1 + 2.0 * (k2 + k3) + slope(f, z + h * k3));
    }
    return z;
}
#endif

static double larger(double a, double b) { return a > b ? a : b; }
static double smaller(double a, double b) { return a < b ? a : b; }

int main(void) {
    double above[AXIS_OPERATORS] = {0.0}, below[AXIS_OPERATORS] = {0.0}, drive;
#if AXIS_DUHEM_KNOTS
    double z = 0.0, last = 0.0;
#endif
    printf("%d %d %u\\n", AXIS_OPERATORS, AXIS_FILTERS, (unsigned)sizeof axis_stage);
    printf("%.17g %.17g %.17g\\n", AXIS_KP, AXIS_KI, axis_filter_b[0][0]);
    while (scanf("%lf", &drive) == 1) {
        double x = drive - AXIS_INPUT_OFFSET, position = AXIS_OUTPUT_OFFSET;
        for (int i = 0; i < AXIS_OPERATORS; i++) {
            above[i] = larger(0.0, larger(x - axis_r[i], smaller(x + axis_rb[i], above[i])));
            below[i] = larger(0.0, larger(-x - axis_ra[i], smaller(-x + axis_rc[i], below[i])));
            position += axis_w[i] * above[i] - axis_v[i] * below[i];
        }
#if AXIS_DUHEM_KNOTS
        z = moved(z, x - last);
        last = x;
        position += z;
#endif
        printf("%.17g\\n", position);
    }
    return 0;
}
"""


# Beside the plays: nothing, an operator that adds, and one that is subtracted.
DUHEM = {
    "plays alone": None,
    "adds": mh.Duhem.from_bouc_wen(0.2, 0.03, 0.8, -0.9),
    "is subtracted": mh.Duhem.from_bouc_wen(-0.2, 0.03, 0.7, -0.3),
}
every_stage = pytest.mark.parametrize("stage", DUHEM, indirect=True)


@pytest.fixture(scope="module")
def stage(request: pytest.FixtureRequest) -> mh.Stage:
    return mh.Stage(
        mh.ModifiedPrandtlIshlinskii.from_ratios(
            [0.5, 0.03, 0.04],
            [0.0, 10.0, 40.0],
            ra=0.95,
            rb=0.3,
            rc=0.35,
            input_offset=1.5,
            weights_negative=[0.4, 0.05, 0.02],
        ),
        limits=(-150.0, 150.0),
        duhem=DUHEM[getattr(request, "param", "plays alone")],
        dynamics=mh.plant.SecondOrder(800.0, 0.02),
    )


@every_stage
@pytest.mark.parametrize("compiler", COMPILERS, ids=["C", "C++"])
def test_a_plain_loop_over_the_header_agrees(
    stage: mh.Stage, tmp_path: Path, compiler: list[str]
) -> None:
    if shutil.which(compiler[0]) is None:
        pytest.skip(f"no {compiler[0]}")
    mh.export.c_header(stage, tmp_path / "axis.h", dt=DT)
    source, program = tmp_path / "loop.c", tmp_path / "loop"
    source.write_text(PROGRAM)
    subprocess.run([*compiler, *WARNINGS, source, "-o", program], check=True)
    drives = np.random.default_rng(3).uniform(-150.0, 150.0, 5000)
    asked = "\n".join(map(repr, drives.tolist()))
    said = subprocess.run([program], input=asked, check=True, capture_output=True, text=True)
    first, second, *positions = said.stdout.splitlines()
    tuned = stage.tune(DT)
    assert first.split() == ["3", str(len(tuned.filters)), str(len(stage.to_bytes()))]
    assert [float(x) for x in second.split()][:2] == [tuned.kp, tuned.ki]
    expected = stage.replace(dynamics=None).forward(DT).run(drives)
    found = np.array([float(x) for x in positions])
    # Sums in another order; small steps over the knots.
    tolerance = 1e-12 if stage.duhem is None else 1e-6
    assert np.abs(found - expected).max() < tolerance * np.ptp(expected)


@pytest.mark.parametrize("compiler", COMPILERS, ids=["C", "C++"])
def test_numbers_may_be_floats(stage: mh.Stage, tmp_path: Path, compiler: list[str]) -> None:
    if shutil.which(compiler[0]) is None:
        pytest.skip(f"no {compiler[0]}")
    mh.export.c_header(stage, tmp_path / "axis.h", dt=DT)
    source, program = tmp_path / "loop.c", tmp_path / "loop"
    source.write_text(
        '#include <stdio.h>\n#define AXIS_REAL float\n#include "axis.h"\n'
        "int main(void) {\n"
        '    printf("%u %.9g", (unsigned)sizeof axis_w, (double)axis_w[1]);\n'
        "    return 0;\n}\n"
    )
    subprocess.run([*compiler, *WARNINGS, source, "-o", program], check=True)
    said = subprocess.run([program], check=True, capture_output=True, text=True).stdout.split()
    assert said[0] == "12" and np.float32(said[1]) == np.float32(0.03)


@every_stage
def test_arrays_of_the_header_are_those_of_the_stage(stage: mh.Stage, tmp_path: Path) -> None:
    mh.export.c_header(stage, tmp_path / "axis.h")
    text = (tmp_path / "axis.h").read_text("utf-8")

    def array(name: str) -> list[float]:
        found = re.search(rf" axis_{name}\[\d+\] = {{(.*?)}};", text, re.DOTALL)
        assert found is not None
        return [float(x) for x in found[1].split(",") if x.strip()]

    model = stage.hysteresis
    for name, numbers in [("w", model.weights), ("r", model.r), ("ra", model.ra), ("rb", model.rb)]:
        assert array(name) == numbers.tolist()
    if stage.duhem is not None:
        for name in ["knots", "rising", "falling"]:
            assert array(f"duhem_{name}") == getattr(stage.duhem, name).tolist()
    found = re.search(r"axis_stage\[\d+\] = {(.*?)};", text, re.DOTALL)
    assert found is not None
    data = bytes(int(x, 16) for x in found[1].split(",") if x.strip())
    assert mh.Stage.from_bytes(data) == stage


@every_stage
def test_a_stage_and_its_states_come_back_from_bytes(stage: mh.Stage) -> None:
    assert mh.Stage.from_bytes(stage.to_bytes()).to_bytes() == stage.to_bytes()
    forward, inverse, controller = stage.forward(DT), stage.inverse(DT), stage.controller(DT)
    for x in [3.0, 30.0, -2.0]:
        forward.step(x), inverse.step(x), controller.step(x, 0.9 * x)
    others = stage.forward(DT), stage.inverse(DT), stage.controller(DT)
    others[0].state = forward.state_bytes()
    others[1].state = inverse.state_bytes()
    others[2].state = controller.state_bytes()
    assert (others[0].state, others[1].state) == (forward.state, inverse.state)
    assert others[2].state == controller.state
    assert others[0].step(7.0) == forward.step(7.0)
    assert others[1].step(7.0) == inverse.step(7.0)
    assert others[2].step(7.0, 5.0) == controller.step(7.0, 5.0)


@every_stage
def test_a_controller_with_an_observer_comes_back_from_bytes(stage: mh.Stage) -> None:
    made = stage.replace(noise=1e-3)
    one, other = (made.controller(DT, drift=0.5) for _ in range(2))
    for x in [3.0, 30.0, -2.0]:
        one.step(x, 0.9 * x)
    other.state = one.state_bytes()
    assert other.state == one.state
    plain = made.controller(DT)
    with pytest.raises(ValueError, match="state: bytes: expected the state of a controller as"):
        plain.state = one.state_bytes()


def test_other_bytes_are_refused(stage: mh.Stage) -> None:
    good = stage.to_bytes()
    for wrong in [b"", good[:-1], good + b"x", good[:50] + b"\xff" + good[51:], b"{}"]:
        with pytest.raises(ValueError, match="bytes: expected a stage as bytes, got") as error:
            mh.Stage.from_bytes(wrong)
        assert getattr(error.value, "parameter", None) == "bytes"
    forward = stage.forward(DT)
    with pytest.raises(ValueError, match="state: bytes: expected the state of a forward model"):
        forward.state = good


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stage: mh.Stage) -> Path:
    """A folder with a stage file, in which commands run."""
    monkeypatch.chdir(tmp_path)
    stage.save(tmp_path / "stage.json")
    return tmp_path


@pytest.mark.parametrize("options", [["--dt", "1e-4"], ["--rate", "10000"]])
@pytest.mark.parametrize("kind", ["forward", "inverse", "controller"])
def test_the_command_writes_a_unit(here: Path, options: list[str], kind: str) -> None:
    result = run("export", "stage.json", "--fmu", "--kind", kind, *options, "-o", "axis.fmu")
    assert result.exit_code == 0, result.output
    assert kind in result.stdout and "written  axis.fmu" in result.stdout
    assert validate_fmu("axis.fmu") == []
    assert names_in(here) == {"stage.json", "axis.fmu"}


@every_stage
def test_the_command_writes_a_header_and_bytes(here: Path, stage: mh.Stage) -> None:
    assert run("export", "stage.json", "--c", "--name", "x").exit_code == 0
    text = (here / "stage.h").read_text("utf-8")
    digest = hashlib.sha256((here / "stage.json").read_bytes()).hexdigest()
    assert f'#define X_SHA256 "{digest}"' in text and "X_DT" not in text
    assert run("export", "stage.json", "--bytes", "-o", "stage.bin").exit_code == 0
    assert mh.Stage.from_bytes((here / "stage.bin").read_bytes()) == stage
    assert run("export", "stage.json", "--c", "--rate", "10000", "-o", "2 b.h").exit_code == 0
    assert "#define _2_B_DT ((_2_B_REAL)0.0001) /* s */" in (here / "2 b.h").read_text("utf-8")
    # Without a name of a file the header of python is the same.
    mh.export.c_header(stage, here / "3.h", name="x")
    assert (here / "3.h").read_text("utf-8") == text


def sha256_in(header: str) -> str:
    found = re.search(r'_SHA256 "([0-9a-f]{64})"', header)
    assert found is not None
    return found[1]


@pytest.mark.skipif(os.name == "nt", reason="pipes")
def test_a_pipe_is_read_once(here: Path) -> None:
    content = (here / "stage.json").read_bytes()
    done = subprocess.run(
        [sys.executable, "-m", "mpi_hyst._cli", "export", "/dev/stdin", "--c", "-o", "x.h"],
        input=content,
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert sha256_in((here / "x.h").read_text("utf-8")) == hashlib.sha256(content).hexdigest()


def test_a_file_is_read_as_load_reads_it(here: Path) -> None:
    assert read_bytes(here / "stage.json") == (here / "stage.json").read_bytes()
    with pytest.raises(FileNotFoundError) as caught:
        read_bytes("none.json")
    assert caught.value.filename == "none.json"


@pytest.mark.parametrize("changed", [["--limits", "-9,9"], ["--slew", "123"]])
def test_the_digest_is_that_of_the_constants(
    here: Path, stage: mh.Stage, changed: list[str]
) -> None:
    assert run("export", "stage.json", "--c", *changed, "-o", "x.h").exit_code == 0
    other = {"limits": (-9.0, 9.0)} if changed[0] == "--limits" else {"slew": 123.0}
    stage.replace(**other).save(here / "other.json")
    digest = hashlib.sha256((here / "other.json").read_bytes()).hexdigest()
    assert sha256_in((here / "x.h").read_text("utf-8")) == digest


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"dt": float("nan")}, "dt: expected a finite number above 0"),
        ({"kind": None}, 'kind: expected "forward", "inverse" or "controller", got None'),
        ({"feedforward": 3}, 'feedforward: expected "inverse" or "preview", got 3'),
        ({"name": 3}, "name: expected a text, got 3"),
    ],
)
def test_what_is_no_unit_is_refused_by_its_name(
    stage: mh.Stage, tmp_path: Path, wrong: dict[str, Any], message: str
) -> None:
    with pytest.raises((ValueError, TypeError)) as caught:
        mh.export.fmu(stage, tmp_path / "x.fmu", **{"dt": DT, **wrong})
    assert str(caught.value).startswith(message)
    assert names_in(tmp_path) == set()


WRONG: dict[str, tuple[list[str], list[str]]] = {
    "no format": ([], ["expected one of --fmu, --c, --bytes, got none"]),
    "two formats": (["--fmu", "--c"], ["got --fmu and --c"]),
    "no interval": (["--fmu"], ["--dt: expected the sampling interval", "--rate"]),
    "two intervals": (["--fmu", "--dt", "1e-4", "--rate", "1e4"], ["--rate", "got both"]),
    "no time": (["--fmu", "--dt", "0"], ["--dt: expected a finite number above 0", "got 0.0"]),
    "NaN time": (["--fmu", "--dt", "nan"], ["--dt: expected a finite number above 0"]),
    "negative time": (["--c", "--dt", "-1"], ["--dt: expected"]),
    "no rate": (["--c", "--rate", "nan"], ["--rate: expected a finite number above 0"]),
    "unknown kind": (
        ["--fmu", "--dt", "1e-4", "--kind", "plant"],
        ["--kind", "'plant'", "inverse"],
    ),
    "kind of a header": (["--c", "--kind", "inverse"], ["--kind: has no effect without --fmu"]),
    "gains of a model": (
        ["--fmu", "--dt", "1e-4", "--gains", "1,2"],
        ["--gains: has no effect without --fmu --kind controller"],
    ),
    "interval of bytes": (["--bytes", "--dt", "1"], ["--dt: has no effect without --fmu or --c"]),
    "wrong gains": (
        ["--fmu", "--dt", "1e-4", "--kind", "controller", "--gains=-1,2"],
        ["--gains: expected"],
    ),
    "wrong name": (["--c", "--name", "2x"], ["--name: expected a name of C", "2x"]),
    "no folder": (["--c", "-o", "none/x.h"], ["none/x.h: the directory none does not exist"]),
    "its input": (["--c", "-o", "stage.json"], ["stage.json: is an input file"]),
    "wrong limits": (["--c", "--limits", "3,1"], ["--limits"]),
}


@pytest.mark.parametrize("wrong", WRONG)
def test_the_command_refuses(here: Path, wrong: str) -> None:
    options, said = WRONG[wrong]
    assert_refused(run("export", "stage.json", *options), here, {"stage.json"}, *said)


def test_the_command_names_a_file_that_is_none(here: Path) -> None:
    result = run("export", "other.json", "--c")
    assert_refused(result, here, {"stage.json"}, "other.json", "No such file")
    (here / "stage.json").write_text("{}")
    assert_refused(run("export", "stage.json", "--c"), here, {"stage.json"}, "stage.json: schema")


def test_a_folder_that_cannot_be_written_to_is_named(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (here / "closed").mkdir()
    monkeypatch.setattr("os.access", lambda path, *_: Path(path).name != "closed")
    result = run("export", "stage.json", "--c", "-o", "closed/x.h")
    before = {"stage.json", "closed"}
    assert_refused(result, here, before, "closed/x.h: cannot write in the directory")


def test_a_package_without_the_library_says_so(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mpi_hyst._fmu._BINARIES", here / "none")
    result = run("export", "stage.json", "--fmu", "--dt", "1e-4")
    assert_refused(result, here, {"stage.json"}, "expected the library of units, got none", "make")
