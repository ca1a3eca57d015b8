"""What identification and diagnosis return: models with their errors, findings, verdicts.

`identify` makes an `Identification`, `identify_many` a `ManyIdentifications`,
`identify_dynamics` a `DynamicsIdentification`, `identify_oscillator` an
`OscillatorIdentification`, `compare` a `Comparison`, `diagnose` a list of `Finding`.
"""

from mpi_hyst._core import (
    ComparedModel,
    Comparison,
    DynamicsIdentification,
    Finding,
    Identification,
    LeftOutLoop,
    ManyIdentifications,
    OscillatorIdentification,
    Quality,
    loop_width,
    verdict,
)

__all__ = [
    "ComparedModel",
    "Comparison",
    "DynamicsIdentification",
    "Finding",
    "Identification",
    "LeftOutLoop",
    "ManyIdentifications",
    "OscillatorIdentification",
    "Quality",
    "loop_width",
    "verdict",
]
