"""What identification and diagnosis return: models with their errors, findings, verdicts.

What identification says of the next record, `Stage.precompensate` hands out as `ErrorBounds`.

`identify` makes an `Identification`, `identify_many` a `ManyIdentifications`,
`identify_dynamics` a `DynamicsIdentification`, `identify_oscillator` an
`OscillatorIdentification`, `identify_axes` an `AxesIdentification`, `identify_places` a
`PlacesIdentification`, `compare` a `Comparison`,
`diagnose` a list of `Finding`.
"""

from mpi_hyst._core import (
    AxesIdentification,
    ComparedModel,
    Comparison,
    DynamicsIdentification,
    ErrorBounds,
    Finding,
    Identification,
    LeftOutLoop,
    ManyIdentifications,
    OscillatorIdentification,
    PlacesIdentification,
    Quality,
    loop_width,
    verdict,
)

__all__ = [
    "AxesIdentification",
    "ComparedModel",
    "Comparison",
    "DynamicsIdentification",
    "ErrorBounds",
    "Finding",
    "Identification",
    "LeftOutLoop",
    "ManyIdentifications",
    "OscillatorIdentification",
    "PlacesIdentification",
    "Quality",
    "loop_width",
    "verdict",
]
