"""Linear dynamics and simulated stages.

`SecondOrder`, `FirstOrder`, `Modes` and `StateSpace` describe the dynamics behind the hysteresis,
`Creep` slow drift after a change of the drive, `LoopShift` the motion of the centre of a loop with
its amplitude, `RelaxingPlays` the change of its width with the rate, `SlowGain` that of its size
while the drive cycles, `TemperatureTerm` what a temperature adds. `HystereticOscillator` is a mode
with hysteresis inside, where no hysteresis in front of linear dynamics is right. `Plant` simulates
a stage with converters, noise and limits, one drive at a time. `MultiAxisPlant` couples several of
them, as the axes of an XY stage. `simulate` runs a controller on a plant, ours or any object with
`read` and `write`, and returns a `Run` with the errors.
"""

from mpi_hyst._core import (
    Antiresonance,
    Creep,
    FirstOrder,
    HystereticOscillator,
    LoopShift,
    Metrics,
    Modes,
    MultiAxisPlant,
    OscillatorForward,
    Plant,
    RelaxingPlays,
    Run,
    SecondOrder,
    SlowGain,
    StateSpace,
    TemperatureTerm,
    simulate,
)

__all__ = [
    "Antiresonance",
    "Creep",
    "FirstOrder",
    "HystereticOscillator",
    "LoopShift",
    "Metrics",
    "Modes",
    "MultiAxisPlant",
    "OscillatorForward",
    "Plant",
    "RelaxingPlays",
    "Run",
    "SecondOrder",
    "SlowGain",
    "StateSpace",
    "TemperatureTerm",
    "simulate",
]
