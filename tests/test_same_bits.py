"""A million mixed samples give the same bits wherever a stage runs.

That is in Rust, Python, ctypes, a C program, functional mock-up units, and the record of a loop in
real time, on a simulated clock. Where Python steps, sample by sample, `make test` compares the
first 100 000 of them, and `make test-random` all.
"""

from __future__ import annotations

import ctypes
import functools
import hashlib
import itertools
import json
import math
import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Literal

import mpi_hyst as mh
import numpy as np
import numpy.typing as npt
import pytest
from units import Unit

Array = npt.NDArray[np.float64]

CHECKOUT = Path(__file__).parents[1]
HERE = CHECKOUT / "crates" / "hysteresis-capi"
STAGE = HERE / "examples" / "stage.json"
SAMPLES, SHIFT, DT, DRIFT = 1_000_000, 503, 1e-4, 0.5
NAMES = ["forward", "inverse", "controller", "observer", "plant", "loop"]
TOOLS = ["make", "cargo", "cc", "pkg-config"]

pytestmark = pytest.mark.skipif(
    not all(map(shutil.which, TOOLS)), reason=f"builds the C library with {', '.join(TOOLS)}"
)


def mixed(seed: int) -> Iterator[float]:
    """The signal of checks/same-bits: smooth, noise, jumps, saturation and not finite, by turns."""
    random, level, mask = seed, 0.0, 2**64 - 1
    for k in itertools.count():
        random ^= random >> 12
        random ^= random << 25 & mask
        random ^= random >> 27
        noise = ((random * 0x2545F4914F6CDD1D & mask) >> 11) / 2**52 - 1.0
        level = noise if k % 50 == 0 else level
        triangle = min(k % 2000, 2000 - k % 2000) / 500.0 - 1.0
        bad = 4 if k % 7 == 0 else 5 if k % 11 == 0 else 6 if k % 13 == 0 else 0
        kind = k // 1000 % 5
        yield [triangle, noise, level, 2.0 * triangle, math.nan, math.inf, -1e200][
            kind if kind < 4 else bad
        ]


@functools.cache
def signal(seed: int, shift: int = 0) -> Array:
    samples = np.fromiter(itertools.islice(mixed(seed), shift, shift + SAMPLES), float)
    samples.setflags(write=False)
    return samples


def outputs_of(made: Callable[[], Any], count: int) -> dict[str, Array]:
    """The outputs of a face: arrays in open loop, so many steps else. Each object runs once."""
    s = signal(1)
    steps, references = made(), 14.0 + 18.0 * s
    in_arrays = hasattr(steps, "forward")
    inverse = steps.inverse(references if in_arrays else references[:count])
    found = {"inverse": inverse, **closed_loop(steps, references[:count])}
    if in_arrays:
        found["forward"] = steps.forward(60.0 + 90.0 * s)
    steps = made()
    found["plant"] = np.fromiter(map(steps.advance, (60.0 + 90.0 * s[:count]).tolist()), float)
    # A reference that is not finite is the last one.
    good = np.abs(references) < 1e100
    assert good[0]
    last = np.maximum.accumulate(np.where(good, np.arange(SAMPLES), 0))
    found["loop"] = closed_loop(made(), references[last][:count])["controller"]
    return {name: found[name] for name in NAMES if name in found}


def closed_loop(steps: Any, references: Array) -> dict[str, Array]:
    d = signal(2, SHIFT)[: references.size]
    drives, estimates = np.empty_like(references), np.empty_like(references)
    drive = position = 0.0
    observe = getattr(steps, "observe", None)
    for k, (reference, bad) in enumerate(zip(references.tolist(), d.tolist(), strict=True)):
        measured = position if abs(bad) < 1e100 else bad
        if observe is not None:
            estimates[k] = observe(drive, measured)
        drives[k] = drive = steps.control(reference, measured)
        position = steps.advance(drive)
    found = {"controller": drives}
    return found if observe is None else {**found, "observer": estimates}


class FromPython:
    """The package."""

    def __init__(self) -> None:
        stage = mh.load(STAGE)
        assert isinstance(stage, mh.Stage)
        self.forward = stage.forward(DT).run
        self.inverse = stage.inverse(DT).run
        self.controller = stage.controller(DT)
        self.control = self.controller.step
        self.observe = stage.observer(DT, drift=DRIFT).step
        self.advance = stage.forward(DT).advance


class FromC:
    """The shared library, as a user of ctypes opens it."""

    def __init__(self, prefix: Path) -> None:
        (path,) = [*prefix.glob("lib/libmpi_hyst.so"), *prefix.glob("lib/libmpi_hyst.dylib")]
        self.library = ctypes.CDLL(str(path))
        self.library.mpih_last_error.restype = ctypes.c_char_p
        assert self.library.mpih_abi() == 1
        self.stage = self.made("stage_from_file", str(STAGE).encode())
        arguments: dict[str, list[float | None]] = {
            "forward": [],
            "inverse": [math.nan, math.nan],
            "controller": [None],
            "observer": [DRIFT, math.nan],
        }
        self.objects = {kind: self.of_stage(kind, *more) for kind, more in arguments.items()}
        self.plant = self.of_stage("forward")
        self.control = self.stepper("controller", 2)
        self.observe = self.stepper("observer", 2)
        self.advance = self.stepper("forward", 1, "advance", self.plant)

    def check(self, status: int) -> None:
        assert status == 0, self.library.mpih_last_error().decode()

    def made(self, name: str, *arguments: Any) -> ctypes.c_void_p:
        made = ctypes.c_void_p()
        self.check(getattr(self.library, f"mpih_{name}")(*arguments, ctypes.byref(made)))
        return made

    def of_stage(self, kind: str, *arguments: float | None) -> ctypes.c_void_p:
        """On the heap."""
        numbers = [x if x is None else ctypes.c_double(x) for x in (DT, *arguments)]
        return self.made(f"{kind}_new", self.stage, *numbers, None, ctypes.c_size_t(0))

    def stepper(self, kind: str, count: int, name: str = "step", of: Any = None) -> Any:
        function = getattr(self.library, f"mpih_{kind}_{name}")
        function.restype = ctypes.c_double
        function.argtypes = [ctypes.c_void_p, *[ctypes.c_double] * count]
        found = of or self.objects[kind]
        return lambda *numbers: function(found, *numbers)

    def run(self, kind: str, numbers: Array) -> Array:
        out, pointer = np.empty_like(numbers), ctypes.POINTER(ctypes.c_double)
        arrays = [array.ctypes.data_as(pointer) for array in (numbers, out)]
        function = getattr(self.library, f"mpih_{kind}_run")
        self.check(function(self.objects[kind], *arrays, ctypes.c_size_t(len(out))))
        return out

    def forward(self, drives: Array) -> Array:
        return self.run("forward", drives)

    def inverse(self, targets: Array) -> Array:
        return self.run("inverse", targets)

    def saved(self) -> str:
        """The state of the controller."""
        needed, of = ctypes.c_size_t(), self.objects["controller"]
        save = self.library.mpih_controller_save
        self.check(save(of, None, ctypes.c_size_t(0), ctypes.byref(needed)))
        text = ctypes.create_string_buffer(needed.value)
        self.check(save(of, text, needed, None))
        return text.value.decode()

    def loaded(self, state: str) -> None:
        self.check(self.library.mpih_controller_load(self.objects["controller"], state.encode()))

    def free(self) -> None:
        for kind, found in [*self.objects.items(), ("forward", self.plant), ("stage", self.stage)]:
            free = getattr(self.library, f"mpih_{kind}_free")
            free.restype = None
            free(found)


class FromUnits:
    """Functional mock-up units, loaded by FMPy and called as a tool calls them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.step_inverse = self.stepper("inverse", 1, "drive")
        self.control = self.stepper("controller", 2, "drive")
        self.advance = self.stepper("forward", 1, "position")

    def stepper(self, kind: Literal["forward", "inverse", "controller"], n: int, out: str) -> Any:
        """Sets the first variables, takes a step, and reads one."""
        path = self.folder / f"{kind}.fmu"
        if not path.exists():
            stage = mh.load(STAGE)
            assert isinstance(stage, mh.Stage)
            mh.export.fmu(stage, path, kind, dt=DT)
        unit = Unit(path)
        inputs, references = (ctypes.c_double * n)(), (ctypes.c_uint * n)(*range(n))
        output, read = ctypes.c_double(), ctypes.c_uint(unit.references[out])
        library, instance = unit.slave.dll, unit.slave.component
        set_real, do_step, get_real = library.fmi2SetReal, library.fmi2DoStep, library.fmi2GetReal
        do_step.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_int]
        one, given, size = ctypes.c_size_t(1), ctypes.byref(output), ctypes.c_size_t(n)
        which, component = ctypes.byref(read), ctypes.c_void_p(instance)

        def step(*numbers: float) -> float:
            inputs[:] = list(numbers)
            status = set_real(component, references, size, inputs)
            status |= do_step(component, 0.0, DT, 1)
            status |= get_real(component, which, one, given)
            assert status == 0 and unit
            return output.value

        return step

    def inverse(self, targets: Array) -> Array:
        return np.fromiter(map(self.step_inverse, targets.tolist()), float)


@pytest.fixture(scope="module")
def prefix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that `make capi` fills."""
    folder = tmp_path_factory.mktemp("capi")
    subprocess.run(["make", "capi", f"CAPI={folder}"], cwd=CHECKOUT, check=True)
    return folder


class InRust:
    """What programs print, in the build of the Rust tests: optimisation changes no bit either."""

    def __init__(self, random: bool) -> None:
        self.profile = ["--release"] if random else []

    def __call__(self, *command: str) -> dict[str, str]:
        command = ("cargo", "run", "--quiet", "--all-features", *self.profile, *command)
        said = subprocess.run(command, cwd=CHECKOUT, check=True, capture_output=True, text=True)
        return dict(line.split() for line in said.stdout.splitlines())


@pytest.fixture(scope="module")
def random(pytestconfig: pytest.Config) -> bool:
    """Whether this is `make test-random`."""
    return bool(pytestconfig.getoption("--hypothesis-profile") == "random")


@pytest.fixture(scope="module")
def in_rust(random: bool) -> InRust:
    """`make test` builds the Rust tests for development, `make test-random` as the package is."""
    return InRust(random)


@pytest.fixture(scope="module")
def in_numbers(in_rust: InRust) -> dict[str, str]:
    """The digests of a million samples in Rust."""
    return in_rust("--example", "digests", "--", str(STAGE))


@pytest.fixture(scope="module")
def count(random: bool) -> int:
    """How many samples Python steps through."""
    return SAMPLES if random else SAMPLES // 10


def compiled(prefix: Path, name: str) -> Path:
    """An example in C, compiled as the pkg-config file says."""
    search = {"PKG_CONFIG_PATH": str(prefix / "lib" / "pkgconfig"), "PATH": os.environ["PATH"]}
    asked = ["pkg-config", "--cflags", "--libs", "mpi_hyst"]
    flags = subprocess.run(asked, env=search, check=True, capture_output=True, text=True).stdout
    program, source = prefix / name, HERE / "examples" / "c" / f"{name}.c"
    warnings = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off"]
    subprocess.run(["cc", *warnings, source, "-o", program, *flags.split()], check=True)
    return program


def as_program(prefix: Path) -> dict[str, Array]:
    program, output = compiled(prefix, "same_bits"), prefix / "same_bits.f64"
    subprocess.run([program, STAGE, output], check=True)
    return dict(zip(NAMES, np.fromfile(output).reshape(len(NAMES), SAMPLES), strict=True))


def outputs_by_bank() -> dict[str, Array]:
    """The outputs of the hysteresis alone: C and the units cannot ask for a method."""
    stage = mh.load(STAGE)
    assert isinstance(stage, mh.Stage)
    s = signal(1)
    forward = stage.hysteresis.forward(method="bank")
    inverse = stage.hysteresis.inverse(stage.limits, method="bank")
    outputs, inputs = forward.run(60.0 + 90.0 * s), inverse.run(14.0 + 18.0 * s)
    return {"bank-forward": outputs, "bank-inverse": inputs}


def digests(outputs: dict[str, Array]) -> dict[str, str]:
    def digest(numbers: Array) -> str:
        return hashlib.sha256(numbers.astype("<f8").tobytes()).hexdigest()

    return {name: digest(numbers) for name, numbers in outputs.items()}


def assert_same(found: dict[str, Array], expected: dict[str, Array]) -> None:
    """The same numbers, as far as both go."""
    for name, numbers in found.items():
        shared = min(numbers.size, expected[name].size)
        assert shared >= SAMPLES // 10
        assert digests({name: numbers[:shared]}) == digests({name: expected[name][:shared]})


@pytest.fixture(scope="module")
def expected(count: int) -> dict[str, Array]:
    """The outputs in Python."""
    python = outputs_of(FromPython, count)
    assert list(python) == NAMES
    assert all(np.isfinite(numbers).all() for numbers in python.values())
    assert all(np.ptp(numbers) > 1.0 for numbers in python.values())
    assert len(set(digests(python).values())) == len(NAMES)
    return python


def test_a_million_mixed_samples_are_the_same_in_every_language(
    prefix: Path, count: int, expected: dict[str, Array], in_numbers: dict[str, str]
) -> None:
    made: list[FromC] = []

    def library() -> FromC:
        made.append(FromC(prefix))
        return made[-1]

    by_ctypes, in_c = outputs_of(library, count), as_program(prefix)
    assert list(by_ctypes) == list(in_c) == NAMES
    assert_same(by_ctypes, expected)
    assert_same(in_c, expected)
    by_bank = outputs_by_bank()
    assert all(np.isfinite(numbers).all() for numbers in by_bank.values())
    assert in_numbers == {**digests(in_c), **digests(by_bank)}
    for one in made:
        one.free()


def test_they_are_the_same_in_functional_mock_up_units(
    tmp_path: Path, count: int, expected: dict[str, Array]
) -> None:
    found = outputs_of(lambda: FromUnits(tmp_path), count)
    assert list(found) == ["inverse", "controller", "plant", "loop"]
    assert_same(found, expected)


def test_they_are_the_same_in_the_record_of_a_loop_in_real_time(
    tmp_path: Path, in_numbers: dict[str, str], in_rust: InRust
) -> None:
    path = tmp_path / "record.npy"
    said = in_rust("--example", "same_bits", "--", str(STAGE), str(path))
    record = np.load(path)
    # Behind the reference the drive goes to rest.
    assert SAMPLES < len(record) < SAMPLES + 1000 and record["drive"][-1] == 0.0
    recorded = {"loop": record["drive"][:SAMPLES]}
    assert said == digests(recorded) == {"loop": in_numbers["loop"]}


def test_a_state_goes_from_c_to_python_and_back(prefix: Path) -> None:
    library, python = FromC(prefix), FromPython()
    for k in range(500):
        row = 10.0 + 0.01 * k, 9.9 + 0.01 * k
        assert library.control(*row) == python.control(*row)
    state = json.loads(library.saved())
    assert state == json.loads(json.dumps(python.controller.state))
    other = FromPython()
    other.controller.state = state
    expected = library.control(20.0, 19.0)
    assert other.control(20.0, 19.0) == expected
    library.loaded(json.dumps(python.controller.state))
    assert library.control(20.0, 19.0) == expected
    library.free()


# ---- several axes, and hysteresis inside


def axes_in_python() -> Array:
    """What axes.c writes: drives and positions of two axes, positions of an oscillator."""
    stage = mh.MultiAxisStage.load(HERE / "examples" / "axes.json")
    controller = stage.controller((-9.0, 9.0), slew=4000.0)
    plant, samples = stage.forward(), 2000

    def square(k: int, period: int) -> float:
        return 0.5 if k // period % 2 == 0 else -0.25

    drives, positions, seen = np.empty((samples, 2)), np.empty((samples, 2)), np.array([0.3, -0.2])
    for k in range(samples):
        later = k + controller.ahead
        references = [0.3 + square(later, 400), -0.2 + square(later, 300)]
        if k % 97 == 0:
            seen[1] = math.nan
        drives[k] = controller.step(references, seen)
        positions[k] = plant.advance(drives[k])
        seen = positions[k].copy()
    oscillator = mh.plant.HystereticOscillator.load(HERE / "examples" / "oscillator.json")
    forces = [math.nan if k % 101 == 0 else 100.0 * square(k, 130) for k in range(samples)]
    shown = oscillator.forward(2.5e-4).run(forces)
    return np.concatenate([drives.ravel(), positions.ravel(), shown])


def test_axes_and_oscillators_are_the_same_in_c(prefix: Path, tmp_path: Path) -> None:
    program = compiled(prefix, "axes")
    files = [HERE / "examples" / "axes.json", HERE / "examples" / "oscillator.json"]
    subprocess.run([program, *files, tmp_path / "axes.f64"], check=True)
    assert np.fromfile(tmp_path / "axes.f64").tobytes() == axes_in_python().tobytes()
