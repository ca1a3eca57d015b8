"""What the functions of `plot` and `reports` are given: checked, and in one form."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from mpi_hyst._core import Identification, ModifiedPrandtlIshlinskii, PrandtlIshlinskii, Stage
from mpi_hyst._quantity import Quantity, Stated
from mpi_hyst._report.models import Shown, default_drive, run
from mpi_hyst._types import Samples, Units

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_MODELS = (PrandtlIshlinskii, ModifiedPrandtlIshlinskii)
_COUNTS = {2: "two", 3: "three"}


def require_matplotlib(what: str) -> None:
    """Refuse `what` if the package for figures is not installed."""
    try:
        import matplotlib  # noqa: F401
    except ModuleNotFoundError as error:
        raise ImportError(f"{what} needs {error.name}: pip install 'mpi_hyst[report]'") from error


def panels(axes: Sequence[Axes], count: int) -> list[Axes]:
    """Return the axes, or say what is wrong with them."""
    from matplotlib.axes import Axes as Drawn

    several = _COUNTS[count]
    if not isinstance(axes, Iterable):
        raise TypeError(f"axes: expected {several} matplotlib axes, got {axes!r}")
    given = list(np.ravel(axes)) if isinstance(axes, np.ndarray) else list(axes)
    if len(given) != count:
        raise ValueError(f"axes: expected {several} axes, got {len(given)}")
    for i, panel in enumerate(given):
        if not isinstance(panel, Drawn):
            raise TypeError(f"axes[{i}]: expected matplotlib axes, got {panel!r}")
    return given


def expect(name: str, value: object, kinds: tuple[type, ...]) -> None:
    """Refuse what is none of the classes."""
    if not isinstance(value, kinds):
        *others, last = (kind.__name__ for kind in kinds)
        names = f"{', '.join(others)} or {last}" if others else last
        article = "an" if names[0] in "AEIO" else "a"
        raise TypeError(f"{name}: expected {article} {names}, got {value!r}")


def expect_shown(name: str, value: object) -> None:
    """Refuse what has no hysteresis."""
    expect(name, value, (Stage, *_MODELS, Identification))


def samples(name: str, values: npt.ArrayLike, like: Samples | None = None) -> Samples:
    """Return a signal: finite, in one dimension, as long as another one."""
    try:
        made = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise TypeError(f"{name}: expected an array of numbers, got {values!r}") from error
    if made.ndim != 1 or made.size < 2:
        raise ValueError(f"{name}: expected at least 2 samples in one row, got shape {made.shape}")
    if like is not None and made.size != like.size:
        raise ValueError(f"{name}: expected {like.size} samples as in u, got {made.size}")
    if not np.isfinite(made).all():
        bad = int(np.flatnonzero(~np.isfinite(made))[0])
        raise ValueError(f"{name}: expected finite numbers, got {made[bad]} at sample {bad}")
    return made


def skipped(skip: int, u: Samples) -> int:
    """Return how many leading samples do not count."""
    if isinstance(skip, bool) or not isinstance(skip, int | np.integer):
        raise TypeError(f"skip: expected a number of samples, got {skip!r}")
    if not 0 <= skip <= u.size - 2:
        raise ValueError(f"skip: expected 0 to {u.size - 2}, got {skip}")
    return int(skip)


def interval(dt: float | None) -> float | None:
    """Return a sampling interval in seconds."""
    if dt is None:
        return None
    if isinstance(dt, bool) or not isinstance(dt, int | float | np.number):
        raise TypeError(f"dt: expected a number of seconds, got {dt!r}")
    if not (math.isfinite(dt) and dt > 0.0):
        raise ValueError(f"dt: expected a finite number above 0, got {dt}")
    return float(dt)


def quantities(units: Units, of: object = None) -> tuple[Quantity, Quantity]:
    """Return drive and position with their units: those given, or those of a stage."""
    if units is None:
        units = of.units if isinstance(of, Stage) else ("", "")
    pair = list(units) if isinstance(units, tuple | list) else []
    if len(pair) != 2 or not all(isinstance(one, str) for one in pair):
        raise TypeError(f"units: expected the names of two units, got {units!r}")
    return Stated("drive", pair[0]), Stated("position", pair[1])


@dataclass(frozen=True)
class Modelled:
    """A drive with what was measured, which may be empty, and what the model makes of it."""

    u: Samples
    y: Samples
    output: Samples
    skip: int
    dt: float | None

    @property
    def seconds(self) -> Samples | None:
        """The time of each sample, if the sampling interval is known."""
        return None if self.dt is None else np.arange(self.u.size, dtype=np.float64) * self.dt


def modelled(
    shown: Shown,
    u: npt.ArrayLike | None,
    y: npt.ArrayLike | None,
    *,
    record: int | None,
    skip: int,
    dt: float | None,
) -> Modelled:
    """Run a model along a drive, and put what was measured beside it."""
    if u is None and y is not None:
        raise TypeError("u: expected the drive at which y was measured, got None")
    drive = default_drive(shown) if u is None else samples("u", u)
    leading, given = skipped(skip, drive), interval(dt)
    measured = np.empty(0) if y is None else samples("y", y, drive)
    if isinstance(shown, Identification):
        of_record: dict[str, Any] = {"record": record, "skip": leading, "dt": given}
        known = given if given is not None or not shown.dt else shown.dt[record or 0]
        if measured.size:
            output = measured - shown.residuals(drive, measured, **of_record)
        else:
            output = shown.predict(drive, dt=given)
        return Modelled(drive, measured, np.asarray(output), leading, known)
    return Modelled(drive, measured, run(shown, drive, given), leading, given)
