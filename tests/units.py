"""Functional mock-up units as FMPy loads them."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from typing import Any

import fmpy
import fmpy.fmi2


class Unit:
    """An instance of a unit that is ready for its first step, or before its initialization."""

    def __init__(self, path: Path, *, initialized: bool = True) -> None:
        self.folder = tempfile.mkdtemp()
        fmpy.extract(str(path), unzipdir=self.folder)
        self.description: Any = fmpy.read_model_description(str(path))
        variables = self.description.modelVariables
        self.references = {one.name: one.valueReference for one in variables}
        self.slave = fmpy.fmi2.FMU2Slave(
            guid=self.description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName="one",
        )
        self.slave.instantiate()
        if initialized:
            self.slave.setupExperiment(startTime=0.0)
            self.slave.enterInitializationMode()
            self.slave.exitInitializationMode()

    def step(self, seconds: float, **inputs: float) -> None:
        """Set inputs by their names, and take a step."""
        for name, value in inputs.items():
            self.slave.setReal([self.references[name]], [value])
        self.slave.doStep(currentCommunicationPoint=0.0, communicationStepSize=seconds)

    def real(self, name: str) -> float:
        """Read a real number by its name."""
        return float(self.slave.getReal([self.references[name]])[0])

    def __del__(self) -> None:
        """Unload the library, then remove its folder."""
        slave = getattr(self, "slave", None)
        if slave is not None and slave.component is not None:
            slave.freeInstance()
        shutil.rmtree(self.folder, ignore_errors=True)
