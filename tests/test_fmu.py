"""Functional mock-up units: valid, and what a stage makes, in a tool that takes them."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any, Literal
from xml.etree import ElementTree

import fmpy
import mpi_hyst as mh
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu
from units import Unit

DT = 1e-4
KINDS: list[Literal["forward", "inverse", "controller"]] = ["forward", "inverse", "controller"]


# Beside the plays: nothing, an operator that adds, and one that is subtracted.
DUHEM = {
    "plays alone": None,
    "adds": mh.Duhem.from_bouc_wen(1e-3, 0.01, 0.8, -0.9),
    "is subtracted": mh.Duhem.from_bouc_wen(-1e-3, 0.01, 0.7, -0.3),
}
every_stage = pytest.mark.parametrize("stage", DUHEM, indirect=True)


@pytest.fixture(scope="module")
def stage(request: pytest.FixtureRequest) -> mh.Stage:
    return mh.Stage(
        mh.paper.table_1_recovered(),
        duhem=DUHEM[getattr(request, "param", "plays alone")],
        limits=(-500.0, 500.0),
        slew=2e6,
        dead_time=1e-4,
        dynamics=mh.plant.SecondOrder(800.0, 0.3),
        creep=mh.plant.Creep.logarithmic(0.012, 0.01, 100.0, 4),
    )


@pytest.fixture(scope="module")
def made(stage: mh.Stage, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("units")
    paths: dict[str, Path] = {kind: folder / f"{kind}.fmu" for kind in KINDS}
    for kind in KINDS:
        mh.export.fmu(stage, paths[kind], kind, dt=DT)
    return paths


def reference() -> list[float]:
    found: list[float] = mh.signals.sine(2.0, 20.0, seconds=0.1, rate=1.0 / DT).tolist()
    found[300:303] = [np.nan, np.inf, -1e200]
    return found


@pytest.mark.parametrize("kind", KINDS)
def test_a_unit_is_valid(made: dict[str, Path], kind: str) -> None:
    assert validate_fmu(str(made[kind])) == []
    described = fmpy.read_model_description(str(made[kind]))
    assert described.fmiVersion == "2.0" and described.modelName == kind
    assert float(described.defaultExperiment.stepSize) == DT
    assert fmpy.supported_platforms(str(made[kind])) == [fmpy.platform]


def test_variables_have_units_limits_and_starts(made: dict[str, Path]) -> None:
    def variable(kind: str, name: str) -> Any:
        described = fmpy.read_model_description(str(made[kind]))
        return next(one for one in described.modelVariables if one.name == name)

    drive = variable("forward", "drive")
    assert (drive.unit, drive.min, drive.max, drive.start) == ("V", "-500.0", "500.0", "0.0")
    assert variable("inverse", "target").unit == "um"
    assert variable("controller", "kp").unit == "V/um"
    assert variable("controller", "drive").causality == "output"


@every_stage
def test_simulate_fmu_gives_the_drives_of_the_inverse(
    made: dict[str, Path], stage: mh.Stage
) -> None:
    targets = np.array([y for y in reference() if abs(y) < 1e100])
    times = DT * np.arange(targets.size)
    rows = np.array(list(zip(times, targets, strict=True)), [("time", float), ("target", float)])
    result = fmpy.simulate_fmu(
        str(made["inverse"]),
        stop_time=DT * targets.size,
        output_interval=DT,
        input=rows,
        output=["drive"],
        fmi_type="CoSimulation",
    )
    # The first row is the start; row k + 1 is behind step k.
    assert result["drive"][0] == 0.0
    expected = stage.inverse(DT).run(targets)
    np.testing.assert_array_equal(result["drive"][1 : targets.size], expected[:-1])


@every_stage
def test_a_loop_of_two_units_is_that_of_the_package(made: dict[str, Path], stage: mh.Stage) -> None:
    plant_unit, controller_unit = Unit(made["forward"]), Unit(made["controller"])
    plant, controller = stage.forward(DT), stage.controller(DT)
    assert controller_unit.real("kp") == controller.kp
    position = 0.0
    for r in reference():
        controller_unit.step(DT, reference=r, measurement=position)
        drive = controller_unit.real("drive")
        assert drive == controller.step(r, position)
        plant_unit.step(DT, drive=drive)
        position = plant_unit.real("position")
        assert position == plant.advance(drive)
    (rejected,) = controller_unit.slave.getInteger([controller_unit.references["rejected"]])
    assert rejected == controller.rejected_count == 3


@every_stage
@pytest.mark.parametrize("kind", KINDS)
def test_a_kept_state_goes_on_in_another_instance(made: dict[str, Path], kind: str) -> None:
    unit, other = Unit(made[kind]), Unit(made[kind])
    name, output = {
        "forward": ("drive", "position"),
        "inverse": ("target", "drive"),
        "controller": ("reference", "drive"),
    }[kind]

    def run(one: Unit) -> list[float]:
        found = []
        for x in [1.0, 2.0, -1.0, 0.5]:
            one.step(DT, **{name: x})
            found.append(one.real(output))
        return found

    run(unit)
    state = unit.slave.getFMUstate()
    kept = unit.slave.serializeFMUstate(state)
    after = run(unit)
    unit.slave.setFMUstate(state)
    assert run(unit) == after
    unit.slave.freeFMUstate(state)
    other.slave.setFMUstate(other.slave.deSerializeFMUstate(kept))
    assert run(other) == after
    wrong = bytes([*kept[:20], kept[20] ^ 1, *kept[21:]])
    with pytest.raises(FMICallException):
        other.slave.deSerializeFMUstate(wrong)


def test_steps_hold_their_inputs_and_must_fit(
    made: dict[str, Path], stage: mh.Stage, capfd: pytest.CaptureFixture[str]
) -> None:
    unit, forward = Unit(made["forward"]), stage.forward(DT)
    unit.step(5 * DT, drive=80.0)
    assert unit.real("position") == [forward.advance(80.0) for _ in range(5)][-1]
    for wrong in [0.0, -DT, 0.4 * DT, 1.5 * DT]:
        with pytest.raises(FMICallException):
            unit.step(wrong)
    said = capfd.readouterr().out
    assert "communicationStepSize: expected a whole multiple of the sampling interval" in said
    assert "0.0001 s, got 0.00015" in said
    unit.slave.reset()
    assert unit.real("position") == stage.forward(DT).position


def test_a_changed_unit_is_refused(made: dict[str, Path], tmp_path: Path) -> None:
    path = tmp_path / "changed.fmu"
    with zipfile.ZipFile(made["forward"]) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            text = old.read(name)
            new.writestr(name, text.replace(b'"guid": "{', b'"guid": "{0'))
    with pytest.raises(Exception, match="Failed to instantiate"):
        Unit(path)


def test_the_same_stage_gives_the_same_bytes(stage: mh.Stage, tmp_path: Path) -> None:
    one, other = tmp_path / "a" / "x.fmu", tmp_path / "b" / "x.fmu"
    for path in (one, other):
        path.parent.mkdir()
        mh.export.fmu(stage, path, "inverse", dt=DT)
    assert one.read_bytes() == other.read_bytes()
    guids = set()
    for change in ({}, {"dt": 2 * DT}, {"name": "y"}):
        mh.export.fmu(stage, one, "inverse", **{"dt": DT, **change})  # type: ignore[arg-type]
        with zipfile.ZipFile(one) as unit:
            guids.add(ElementTree.fromstring(unit.read("modelDescription.xml")).attrib["guid"])
            assert json.loads(unit.read("resources/stage.json"))["schema"] == "mpi_hyst/stage/1"
    assert len(guids) == 3


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"kind": "plant"}, 'kind: expected "forward", "inverse" or "controller"'),
        ({"dt": 0.0}, "dt: expected a finite number above 0"),
        ({"dt": "1"}, "dt: expected a number"),
        ({"feedforward": "none"}, 'feedforward: expected "inverse" or "preview"'),
        ({"feedforward": "preview"}, "feedforward: expected none without kind"),
        ({"gains": (1.0, 2.0)}, "gains: expected none without kind"),
        ({"kind": "controller", "gains": (1.0,)}, "gains: expected two numbers"),
        ({"kind": "controller", "gains": (-1.0, 0.0)}, "kp: expected"),
    ],
)
def test_wrong_arguments_are_named(
    stage: mh.Stage, tmp_path: Path, wrong: dict[str, Any], message: str
) -> None:
    path = tmp_path / "x.fmu"
    with pytest.raises((ValueError, TypeError)) as error:
        mh.export.fmu(stage, path, **{"dt": DT, **wrong})
    assert str(error.value).startswith(message)
    assert getattr(error.value, "parameter", None) == message.partition(":")[0]
    assert not path.exists()


def test_a_controller_needs_limits(tmp_path: Path) -> None:
    stage = mh.Stage(mh.paper.table_1_recovered())
    with pytest.raises(ValueError, match="limits: expected"):
        mh.export.fmu(stage, tmp_path / "x.fmu", "controller", dt=DT)
    mh.export.fmu(stage, tmp_path / "x.fmu", "forward", dt=DT)
    assert validate_fmu(str(tmp_path / "x.fmu")) == []
