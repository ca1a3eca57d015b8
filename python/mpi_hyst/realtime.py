"""The loop of a stage in real time, at a fixed rate in a thread outside the interpreter.

`run` takes a controller, what is read from and written to, and a reference. It returns a
`LoopReport` with `LoopTimes`. A simulated `plant.Plant`, `Functions` of C, `Udp`, `SharedMemory`
or any object with `read` and `write` can be driven. `Stop` ends it from another thread.
"""

from mpi_hyst._core import Functions, LoopReport, LoopTimes, SharedMemory, Stop, Udp, run

__all__ = ["Functions", "LoopReport", "LoopTimes", "SharedMemory", "Stop", "Udp", "run"]
