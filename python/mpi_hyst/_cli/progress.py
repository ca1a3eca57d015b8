"""Progress bars on standard error."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import count
from typing import NoReturn

from tqdm import tqdm

from mpi_hyst._progress import FORM
from mpi_hyst._text import in_unit

Progress = Callable[[float, float], None]


def _bar(what: str) -> tqdm[NoReturn]:
    # None: shown only on a terminal. Standard error may be closed.
    disable = True if sys.stderr is None else None
    return tqdm(
        total=1.0, desc=what, bar_format=FORM, file=sys.stderr, leave=False, disable=disable
    )


@contextmanager
def progress_bar(what: str, unit: str = "") -> Iterator[Progress]:
    """Show the fraction done and the best error so far."""
    with _bar(what) as bar:

        def show(fraction: float, best_rmse: float) -> None:
            bar.set_postfix_str(f"best rms {in_unit(best_rmse, unit, 3)}", refresh=False)
            bar.update(fraction - bar.n)

        yield show


@contextmanager
def fraction_bar(what: str) -> Iterator[Callable[[float], None]]:
    """Show the fraction done."""
    with _bar(what) as bar:

        def show(fraction: float) -> None:
            bar.update(fraction - bar.n)

        yield show


@contextmanager
def step_bar(what: str, steps: int) -> Iterator[Callable[[], None]]:
    """Show the fraction of steps done."""
    done = count(1)
    with fraction_bar(what) as show:
        yield lambda: show(next(done) / steps)
