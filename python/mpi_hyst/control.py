"""Control: the hybrid controller, its tuning, feed-forward through inverse dynamics, learning.

`HybridController` adds feedback to the inverse of a model; `tune` finds its gains.
`ArrayController` does it for the many actuators of a deformable mirror. `Notch`, `LowPass`,
`Lead` and `Biquad` are filters of the feedback. `preview` and `invert_dynamics` lead the
reference through the inverse of linear dynamics, online and offline;
`precompensate` returns the drive of a whole trajectory. `IterativeLearning` and
`RepetitiveControl` learn from repetition. `Observer` estimates the position from a noisy sensor.
`MultiAxisController` decouples axes that move each other.
"""

from mpi_hyst._core import (
    ArrayController,
    Biquad,
    ControllerTerms,
    Filter,
    HybridController,
    IterativeLearning,
    Lead,
    LowPass,
    Margins,
    MultiAxisController,
    Notch,
    Observer,
    Preview,
    RepetitiveControl,
    Tuning,
    invert_dynamics,
    precompensate,
    preview,
    tune,
)

__all__ = [
    "ArrayController",
    "Biquad",
    "ControllerTerms",
    "Filter",
    "HybridController",
    "IterativeLearning",
    "Lead",
    "LowPass",
    "Margins",
    "MultiAxisController",
    "Notch",
    "Observer",
    "Preview",
    "RepetitiveControl",
    "Tuning",
    "invert_dynamics",
    "precompensate",
    "preview",
    "tune",
]
