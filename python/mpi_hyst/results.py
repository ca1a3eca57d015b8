"""What identification and diagnosis return: models with their errors, findings, verdicts.

`identify` makes an `Identification`, `identify_many` a `ManyIdentifications`,
`identify_dynamics` a `DynamicsIdentification`, `diagnose` a list of `Finding`.
"""

from mpi_hyst._core import (
    DynamicsIdentification,
    Finding,
    Identification,
    LeftOutLoop,
    ManyIdentifications,
    Quality,
    loop_width,
    verdict,
)

__all__ = [
    "DynamicsIdentification",
    "Finding",
    "Identification",
    "LeftOutLoop",
    "ManyIdentifications",
    "Quality",
    "loop_width",
    "verdict",
]
