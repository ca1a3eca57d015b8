"""Scans one after the other: positions of several axes in, drives out, and nothing is forgotten.

`Scanner` is what the software of a microscope or a beamline needs of this package. It carries
what hysteresis, loop shift and creep remember from scan to scan, and through a file from process
to process.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from threading import RLock
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from mpi_hyst._core import HeldBackWarning, PrandtlIshlinskii, Stage, StartError
from mpi_hyst._files import write_file
from mpi_hyst._types import Samples

__all__ = ["Scanner"]


def __dir__() -> list[str]:
    return __all__


_FORMAT = "mpi_hyst.scanner"
_ROUNDING = 1e-9
"""What rounding may take a position from its target, relative to it."""
_ROOM = 0.05
"""What creep and its kin may take a position beyond the range of the stage, as a share of it."""
_MISSED = 2e-3
"""What a lead-in may miss on its way, as a share of the range."""
_BLOCK = 1_000_000
"""So many samples are waited at once."""
_ITSELF = Stage(PrandtlIshlinskii([1.0], [0.0]))
"""As its drive is its own position, the drive for a motion is the motion itself, sampled."""

_Path: TypeAlias = str | PathLike[str]


def way_to(
    reference: Samples,
    dt: float,
    lead_in: float,
    *,
    start: float,
    within: tuple[float, float] | None,
) -> Samples:
    """Return the lead-in of a reference, smooth and from rest, as `Stage.precompensate` makes it.

    To gain the velocity of the reference it begins behind it, as far as that lies `within`.
    """
    limits = None
    if within is not None:
        # A reference at the end of the range, or where only a history leads, has no room behind it.
        reach = [start, float(reference.min()), float(reference.max()), *within]
        limits = min(reach), max(reach)
    path = _ITSELF.replace(limits=limits).precompensate(reference, dt, start=start, lead_in=lead_in)
    return path[: path.size - reference.size]


class Scanner:
    """The drives of scans of several axes, one scan after the other.

    It does for every axis what `Stage.precompensate` does, and goes on where the last scan ended. A
    scan that a stage cannot follow is refused as a whole, and nothing has changed then: no drive
    is ever beyond the limits of its stage or faster than its slew rate.

    The drives that it returns must be put out, each for `dt`. Tell it of time that passes between
    scans (`wait`), and of drives that something else has put out (`follow`). Threads take turns.

    Parameters
    ----------
    stages : dict of str to Stage
        The axes by their names. Every stage needs limits.
    dt : float
        Sampling interval in seconds.
    start : dict of str to float, optional
        The drives at which the stages have rested; by default 0, or the limit nearest to it.

    Raises
    ------
    ValueError, TypeError
        That name the axis, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> creep = mh.plant.Creep.logarithmic(0.012, 0.01, 100.0, 8)
    >>> stage = mh.Stage(mh.paper.table_1_recovered(), limits=(-500.0, 500.0), creep=creep)
    >>> scanner = mh.scan.Scanner({"x": stage, "y": stage}, dt=1e-3)
    >>> line = mh.signals.triangle(2.0, 5.0, seconds=0.2, rate=1000)  # um
    >>> first = scanner.run({"x": line})  # V; y stays where it is
    >>> scanner.wait(0.5)  # seconds
    >>> second = scanner.run({"x": 0.5 * line, "y": line}, lead_in=0.02)
    >>> second["x"].size == second["y"].size == line.size + 20
    True
    >>> bench = stage.forward(dt=1e-3)  # the same, driven by x
    >>> _ = bench.run(first["x"]), bench.run([first["x"][-1]] * 500)
    >>> bool(abs(bench.run(second["x"])[20:] - 0.5 * line).max() < 1e-12)
    True

    """

    def __init__(
        self, stages: Mapping[str, Stage], dt: float, *, start: Mapping[str, float] | None = None
    ) -> None:
        """Put every axis at rest."""
        if not isinstance(stages, Mapping) or not stages:
            raise ValueError(f"stages: expected a dictionary of stages by axis, got {stages!r}")
        rest = dict(start or {})
        self._dt = dt
        self._turn = RLock()
        self._axes = {
            name: _Axis(name, stage, dt, rest.pop(name, None)) for name, stage in stages.items()
        }
        self._known("start", rest)

    @property
    def axes(self) -> tuple[str, ...]:
        """The names of the axes."""
        return tuple(self._axes)

    @property
    def dt(self) -> float:
        """The sampling interval in seconds."""
        return self._dt

    @property
    def drives(self) -> dict[str, float]:
        """The last drive of every axis."""
        with self._turn:
            return {name: axis.drive for name, axis in self._axes.items()}

    @property
    def positions(self) -> dict[str, float]:
        """Where every axis is at rest at its last drive, its modes at their ends."""
        with self._turn:
            return {name: axis.position for name, axis in self._axes.items()}

    def run(
        self,
        positions: Mapping[str, ArrayLike | Any],
        *,
        lead_in: float | None = None,
        write: Callable[[dict[str, Samples]], object] | None = None,
    ) -> dict[str, Samples]:
        """Return the drives of a scan, and take them for put out.

        Parameters
        ----------
        positions : dict of str to array, or to one of `trajectories`
            The positions of the axes that move, all equally long. Every other axis keeps its drive.
        lead_in : float, optional
            Seconds of a smooth way from where the axes are to the beginning of the scan, in front
            of it. It stays within what the scan and `position_range` of the stage span. Without it
            every axis must begin where it is.
        write : callable, optional
            Puts out the drives of all axes. If it raises an exception, nothing was put out: the
            exception passes, and nothing is remembered.

        Returns
        -------
        dict of str to array
            The drives of all axes, equally long: the scan, behind its lead-in.

        Raises
        ------
        ValueError, TypeError
            That name the axis, what was expected and what came. Nothing has changed then.

        Warns
        -----
        UserWarning
            If a scan begins in motion without a lead-in: its first samples are missed.

        """
        self._known("positions", positions)
        if not positions:
            raise ValueError("positions: expected at least one axis, got none")
        with self._all_or_nothing():
            found = {}
            # A comprehension may be a call of its own, and a warning names the line of the caller.
            for name, wanted in positions.items():
                found[name] = self._axes[name].run(wanted, lead_in)
            samples = {name: drive.size for name, drive in found.items()}
            if len(set(samples.values())) > 1:
                raise ValueError(f"positions: expected all axes equally long, got {samples}")
            count = next(iter(samples.values()))
            held = {
                name: axis.hold(count) for name, axis in self._axes.items() if name not in found
            }
            drives = {name: (found | held)[name] for name in self._axes}
            if write is not None:
                write(drives)
            return drives

    def wait(self, seconds: float) -> None:
        """Take over that the drives stay as they are for a time: creep goes on."""
        if not 0.0 <= seconds < np.inf:
            raise ValueError(f"seconds: expected a finite time of at least 0, got {seconds!r}")
        left = round(seconds / self._dt)
        with self._all_or_nothing():
            while left > 0:
                for axis in self._axes.values():
                    axis.hold(min(left, _BLOCK))
                left -= _BLOCK

    def follow(self, drives: Mapping[str, ArrayLike]) -> None:
        """Take over what something else has put out, oldest drive first, one for each `dt`."""
        self._known("drives", drives)
        with self._all_or_nothing():
            for name, put_out in drives.items():
                self._axes[name].follow(put_out)

    @property
    def state(self) -> dict[str, Any]:
        """Everything that is remembered, as a dictionary; set it to continue bit for bit."""
        with self._turn:
            axes = {name: axis.state for name, axis in self._axes.items()}
        return {"format": _FORMAT, "version": 1, "dt": self._dt, "axes": axes}

    @state.setter
    def state(self, state: dict[str, Any]) -> None:
        known = isinstance(state, dict) and (state.get("format"), state.get("version"))
        if known != (_FORMAT, 1) or not isinstance(state.get("axes"), dict):
            raise ValueError("state: expected the state of a scanner")
        if state.get("dt") != self._dt:
            raise ValueError(f"state: expected dt = {self._dt!r}, got {state.get('dt')!r}")
        if set(state["axes"]) != set(self._axes):
            raise ValueError(f"state: expected the axes {self.axes}, got {tuple(state['axes'])}")
        with self._all_or_nothing():
            for name, axis in self._axes.items():
                axis.state = state["axes"][name]

    def save(self, path: _Path) -> None:
        """Write the state to a JSON file, which appears only when it is complete.

        Examples
        --------
        >>> import mpi_hyst as mh, pathlib, tempfile
        >>> stage = mh.Stage(mh.paper.table_1_recovered(), limits=(-500.0, 500.0))
        >>> scanner = mh.scan.Scanner({"x": stage}, dt=1e-3)
        >>> _ = scanner.run({"x": mh.signals.triangle(2.0, 5.0, seconds=0.13, rate=1000)})
        >>> path = pathlib.Path(tempfile.mkdtemp()) / "scanner.json"
        >>> scanner.save(path)
        >>> another = mh.scan.Scanner({"x": stage}, dt=1e-3)  # as in another process
        >>> another.load(path)
        >>> another.drives == scanner.drives, another.state == scanner.state
        (True, True)

        """
        write_file(Path(path), json.dumps(self.state, indent=1) + "\n")

    def load(self, path: _Path) -> None:
        """Go on from a file of `save`, bit for bit; the stages must be the same.

        Raises ValueError with the name of the file if it is another one, and changes nothing then.
        """
        try:
            self.state = json.loads(Path(path).read_text("utf-8"))
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from error

    @contextmanager
    def _all_or_nothing(self) -> Iterator[None]:
        with self._turn:
            before = {name: axis.state for name, axis in self._axes.items()}
            try:
                yield
            except BaseException:
                for name, axis in self._axes.items():
                    axis.state = before[name]
                raise

    def _known(self, argument: str, named: Mapping[str, Any]) -> None:
        if not isinstance(named, Mapping):
            raise TypeError(f"{argument}: expected a dictionary by axis, got {named!r}")
        unknown = [name for name in named if name not in self._axes]
        if unknown:
            raise ValueError(f"{argument}: expected axes of {self.axes}, got {unknown[0]!r}")


class _Axis:
    """A stage with its memory: inverses of its fast part, of the slow one, of the amplifier."""

    def __init__(self, name: str, stage: Stage, dt: float, start: float | None) -> None:
        if not isinstance(stage, Stage):
            got = f"got {stage!r}; a MultiAxisStage has a precompensate of its own, for all axes"
            raise TypeError(f"stages[{name!r}]: expected a Stage, {got}")
        if stage.drive_range is None:
            raise ValueError(f"stages[{name!r}]: expected a stage with limits, got one without")
        self._name, self._dt = name, dt
        slow = Stage(
            stage.hysteresis,
            limits=stage.drive_range,
            amplifier_bandwidth=stage.amplifier_bandwidth,
            creep=stage.creep,
            loop_shift=stage.loop_shift,
            relaxing_plays=stage.relaxing_plays,
            slow_gain=stage.slow_gain,
            duhem=stage.duhem,
            input_map=stage.input_map,
            output_map=stage.output_map,
            units=stage.units,
        )
        self._inverse, self._forward = slow.inverse(dt, amplifier=True), slow.forward(dt)
        # What the amplifier makes of targets, each read before its drive acts.
        lag = Stage(PrandtlIshlinskii([1.0], [0.0]), amplifier_bandwidth=stage.amplifier_bandwidth)
        self._lag = lag.forward(dt)
        if stage.position_range is None:
            raise ValueError(
                f"stages[{name!r}]: expected a stage that reaches positions after any loops,"
                " got one whose loops drift apart"
            )
        reached = [*map(self._forward.settle, stage.drive_range), *stage.position_range]
        low, high = min(reached), max(reached)
        self._tolerance = _MISSED * (high - low)
        room = _ROOM * (high - low)
        # What the fast part is fed with is a position: as a drive it is its own position.
        self._fast = Stage(
            PrandtlIshlinskii([1.0], [0.0]),
            limits=(low - room, high + room),
            dead_time=stage.dead_time,
            amplifier_bandwidth=stage.amplifier_bandwidth,
            dynamics=stage.dynamics,
        )
        self._range = stage.position_range
        self._unit = stage.units[1]
        low, high = self._range
        self._reach = f"positions that the stage reaches, {low:g} to {high:g} {self._unit}"
        self._at_rest = self._fast.forward(dt)
        self._step = np.inf if stage.slew is None else stage.slew * dt
        low, high = stage.drive_range
        rest = min(max(0.0, low), high) if start is None else start
        if not low <= rest <= high:
            raise ValueError(f"start[{name!r}]: expected a drive in [{low}, {high}], got {rest!r}")
        self._inverse.settle(rest)
        self._lag.settle(self._forward.settle(rest))
        self.drive = float(rest)

    @property
    def position(self) -> float:
        return self._at_rest.settle(self._forward.position)

    def run(self, wanted: ArrayLike | Any, lead_in: float | None) -> Samples:
        targets, before = self._targets(wanted, lead_in)
        drives = self._inverse.run(targets)
        far = np.abs(self._forward.run(drives) - self._lag.run(targets))
        missed = far > _ROUNDING * (1.0 + np.abs(targets))
        # On its way a lead-in may miss what modes and lags ask for at the very end of the range.
        missed[:before] = far[:before] > self._tolerance
        if missed[:before].any():
            advice = "begin farther within them, or give a longer lead_in"
            raise self._refused(f"the lead-in leaves the {self._reach}: {advice}")
        if missed.any():
            many = f"{missed.sum()} of {missed.size}, the first at sample {missed.argmax()}"
            raise self._refused(f"expected {self._reach}, and {many} are not")
        fast = np.abs(np.diff(drives, prepend=self.drive)) > self._step * (1.0 + _ROUNDING)
        if fast.any():
            many = f"{fast.sum()} of {fast.size} drives, the first at sample {fast.argmax()},"
            advice = "scan more slowly, or give a longer lead_in"
            raise self._refused(f"{many} move faster than the slew rate of the stage: {advice}")
        self.drive = float(drives[-1])
        return drives

    def _targets(self, wanted: ArrayLike | Any, lead_in: float | None) -> tuple[Samples, int]:
        """Return what the slow part is to reach, from where it is, and how much is lead-in."""
        start = self._forward.position
        before = 0
        try:
            with warnings.catch_warnings(record=True) as told:
                warnings.simplefilter("always")
                if lead_in is not None:
                    wanted, before = self._led_in(wanted, lead_in)
                targets = self._fast.precompensate(wanted, self._dt, start=start)
        except StartError as error:
            here = f"expected to begin where the stage is, at {self.position:g} {self._unit}"
            raise self._refused(f"{here}, or a lead_in") from error
        except (ValueError, TypeError) as error:
            raise type(error)(f"positions[{self._name!r}]: {error}") from error
        for warning in told:
            if issubclass(warning.category, HeldBackWarning):
                raise self._refused(f"expected {self._reach} ({warning.message})")
            if lead_in is None:
                what = "begin in motion, so the drive begins with a step: give a lead_in"
                warnings.warn(f"positions[{self._name!r}]: {what}", stacklevel=4)
        return targets, before

    def _led_in(self, wanted: ArrayLike | Any, lead_in: float) -> tuple[Samples, int]:
        """Return positions behind a lead-in that stays within the range, and its length."""
        here = self.position
        scan = _ITSELF.precompensate(wanted, self._dt, start=here, lead_in=self._dt)[1:]
        before = way_to(scan, self._dt, lead_in, start=here, within=self._range)
        return np.concatenate([before, scan]), before.size

    def hold(self, samples: int) -> Samples:
        held = np.full(samples, self.drive)
        self.follow(held)
        return held

    def follow(self, drives: ArrayLike) -> None:
        put_out = np.asarray(drives, dtype=np.float64)
        self._inverse.follow(put_out)
        self._forward.follow(put_out)
        self._lag.settle(self._forward.position)
        if put_out.size:
            self.drive = float(put_out[-1])

    @property
    def state(self) -> dict[str, Any]:
        return {"drive": self.drive, "inverse": self._inverse.state, "forward": self._forward.state}

    @state.setter
    def state(self, state: dict[str, Any]) -> None:
        if not isinstance(state, dict) or set(state) != {"drive", "inverse", "forward"}:
            raise ValueError(f"axes[{self._name!r}]: expected the state of an axis")
        try:
            self._inverse.state = state["inverse"]
            self._forward.state = state["forward"]
        except (ValueError, TypeError) as error:
            raise ValueError(f"axes[{self._name!r}]: {error}") from error
        self._lag.settle(self._forward.position)
        self.drive = float(state["drive"])

    def _refused(self, why: str) -> ValueError:
        return ValueError(f"positions[{self._name!r}]: {why}")
