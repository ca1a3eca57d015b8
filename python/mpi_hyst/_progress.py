"""The bar that shows how far long work is, in a terminal or in a notebook."""

from __future__ import annotations

import sys
from types import TracebackType
from typing import Any

FORM = "{desc} {percentage:3.0f}% |{bar}| {elapsed}{postfix}"


class ProgressBar:
    """A progress bar for the argument `progress` of everything that takes long.

    In a notebook a bar of the notebook, elsewhere one on standard error. It closes when the work is
    done; leave it with `with` to close it after an error too. A bar is for one call. It needs
    `mpi_hyst[cli]`; a bar of a notebook also ipywidgets.

    Parameters
    ----------
    what : str
        What is written before the bar.

    Raises
    ------
    ImportError
        If tqdm is not installed.
    TypeError
        If `what` is no text.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=12, rate=200)
    >>> y = mh.paper.table_1_recovered().forward().run(u)
    >>> with mh.ProgressBar("fitting") as bar:
    ...     found = mh.identify(u, y, operators=8, input_offset=0.0, progress=bar)
    >>> bar.fraction
    1.0

    """

    def __init__(self, what: str = "") -> None:
        if not isinstance(what, str):
            raise TypeError(f"what: expected a text, got {what!r}")
        try:
            from tqdm.auto import tqdm
        except ModuleNotFoundError as error:
            raise ImportError(
                f"a progress bar needs {error.name}: pip install 'mpi_hyst[cli]'"
            ) from error
        self._bar: Any = tqdm(total=1.0, desc=what, bar_format=FORM, file=sys.stderr)
        self._fraction = 0.0

    @property
    def fraction(self) -> float:
        """The share of the work that is done, 0 to 1."""
        return self._fraction

    def __call__(self, fraction: float, *told: float) -> None:
        """Show the share done, and beside it the best rms error or the number of actuators."""
        self._fraction = float(fraction)
        if told:
            name = "done" if isinstance(told[0], int) else "best rms"
            self._bar.set_postfix_str(f"{name} {told[0]:.3g}", refresh=False)
        self._bar.update(self._fraction - self._bar.n)
        if self._fraction >= 1.0:
            self.close()

    def close(self) -> None:
        """Close the bar, which stays visible."""
        self._bar.close()

    def __enter__(self) -> ProgressBar:
        """Return the bar."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close the bar. What ended without an error is done, even if it never said so."""
        if kind is None and self._fraction < 1.0:
            self(1.0)
        self.close()
