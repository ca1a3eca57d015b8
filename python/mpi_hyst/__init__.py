"""Piezo hysteresis: coupled-play models, their exact inverse, identification and compensation.

This module has stages, models, streams and identification. Control laws are in `control`, linear
dynamics and simulation in `plant`, test signals in `signals`, references in `trajectories`, the
results of identification in `results`, the loop on a clock in `realtime`, scans one after the other
in `scan`, files of records in `io`, measured records in `datasets`, files for other tools in
`export`, figures in `plot`, reports in `reports`, and the published actuator in `paper`.
"""

from mpi_hyst import (
    _methods,
    control,
    datasets,
    export,
    io,
    paper,
    plant,
    plot,
    realtime,
    reports,
    results,
    scan,
    signals,
    trajectories,
)
from mpi_hyst._core import (
    ActuatorArray,
    Bracket,
    BracketArray,
    CoupledPlay,
    Forward,
    ForwardArray,
    Inverse,
    InverseArray,
    ModifiedPrandtlIshlinskii,
    NotInvertibleError,
    Play,
    PrandtlIshlinskii,
    RecursiveIdentifier,
    Stage,
    StageForward,
    StageInverse,
    __version__,
    compare,
    diagnose,
    identify,
    identify_dynamics,
    identify_many,
    load,
)
from mpi_hyst._progress import ProgressBar

_methods.attach()

__all__ = [
    "ActuatorArray",
    "Bracket",
    "BracketArray",
    "CoupledPlay",
    "Forward",
    "ForwardArray",
    "Inverse",
    "InverseArray",
    "ModifiedPrandtlIshlinskii",
    "NotInvertibleError",
    "Play",
    "PrandtlIshlinskii",
    "ProgressBar",
    "RecursiveIdentifier",
    "Stage",
    "StageForward",
    "StageInverse",
    "__version__",
    "compare",
    "control",
    "datasets",
    "diagnose",
    "export",
    "identify",
    "identify_dynamics",
    "identify_many",
    "io",
    "load",
    "paper",
    "plant",
    "plot",
    "realtime",
    "reports",
    "results",
    "scan",
    "signals",
    "trajectories",
]
