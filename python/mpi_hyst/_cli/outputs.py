"""Output files: checked before the work starts, written completely or not at all, and signals."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

import numpy as np

from mpi_hyst._cli.terminal import CommandError
from mpi_hyst._files import check_regular, write_file
from mpi_hyst._types import Samples

_FIGURES = (".svg", ".png", ".pdf")


@dataclass(frozen=True)
class Output:
    """A file to write, and the function that writes it completely or not at all."""

    path: Path
    write: Callable[[Path], object]

    @classmethod
    def of(cls, path: Path, content: str | bytes) -> Output:
        """Make an output with this content."""
        return cls(path, lambda place: write_file(place, content))


def check_outputs(outputs: Sequence[Path | None], inputs: Sequence[Path] = ()) -> None:
    """Refuse files that could not be written after the work, or would overwrite an input."""
    seen: set[str] = set()
    for path in outputs:
        if path is None:
            continue
        _check_place(path)
        if any(_same_file(path, source) for source in inputs):
            raise CommandError(f"{path}: is an input file and would be overwritten")
        place = os.path.realpath(path)
        if place in seen:
            raise CommandError(f"{path}: named for two outputs")
        seen.add(place)


def check_figure(path: Path) -> None:
    """Refuse a name of a figure whose end is no kind of figure."""
    if path.suffix.lower() not in _FIGURES:
        raise CommandError(f"--plot: expected a name that ends in .svg, .png or .pdf, got {path}")


def check_directory(directory: Path) -> None:
    """Refuse a directory that cannot be written to or made."""
    if directory.exists() and not directory.is_dir():
        raise CommandError(f"{directory}: is not a directory")
    there = next(place for place in (directory, *directory.absolute().parents) if place.exists())
    if not there.is_dir() or not os.access(there, os.W_OK | os.X_OK):
        raise CommandError(f"{there}: cannot write in this directory")


def write_outputs(outputs: Sequence[Output], directory: Path | None = None) -> None:
    """Make the directory and write the files in order; an error lists those already written.

    Ctrl-C is ignored from here on, so that no command says "nothing written" after writing.
    """
    hold_interrupts()
    if directory is not None:
        directory.mkdir(parents=True, exist_ok=True)
    written: list[str] = []
    for output in outputs:
        try:
            output.write(output.path)
        except OSError as error:
            before = f"; written before: {', '.join(written)}" if written else ""
            reason = error.strerror or str(error).removeprefix(f"{output.path}: ")
            raise CommandError(f"{output.path}: {reason}{before}") from error
        written.append(str(output.path))


def _check_place(path: Path) -> None:
    if path.is_dir():
        raise CommandError(f"{path}: is a directory, expected a file name")
    directory = path.parent
    if not directory.is_dir():
        raise CommandError(f"{path}: the directory {directory} does not exist")
    check_regular(path)
    # The directory of the file itself, if the path is a link.
    directory = Path(os.path.realpath(path)).parent
    if not os.access(directory, os.W_OK | os.X_OK):
        raise CommandError(f"{path}: cannot write in the directory {directory}")


def _same_file(path: Path, source: Path) -> bool:
    return path.exists() and source.exists() and path.samefile(source)


def write_table(columns: Mapping[str, Sequence[float] | Samples]) -> str:
    """Return the text of a CSV file. Every number reads back to the same bits."""
    lines = [",".join(_quoted(name) for name in columns)]
    lists = [np.asarray(column).tolist() for column in columns.values()]
    lines.extend(",".join(map(repr, row)) for row in zip(*lists, strict=True))
    return "\n".join(lines) + "\n"


def _quoted(name: str) -> str:
    return f'"{name.replace(chr(34), chr(34) * 2)}"' if set(name) & set(',"\r\n') else name


_ENDING = [getattr(signal, name, None) for name in ("SIGINT", "SIGTERM", "SIGHUP")]
_SIGNALS = [number for number in _ENDING if number is not None]  # Windows has no SIGHUP


def hold_interrupts() -> None:
    """Ignore Ctrl-C from now on. The command ends shortly after."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, _ignore)


def call_at_interrupts(action: Callable[[], object]) -> None:
    """Call `action` at Ctrl-C, SIGTERM and SIGHUP from now on; an ignored signal stays so."""
    if threading.current_thread() is not threading.main_thread():
        return
    for number in _SIGNALS:
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, lambda *_: action())


@contextmanager
def interrupts_restored(*, ends_process: bool = False) -> Iterator[None]:
    """Restore the handlers of these signals at the end, or ignore what comes while Python ends."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in _SIGNALS}
    try:
        yield
    finally:
        for number, handler in before.items():
            restored = signal.SIG_DFL if handler is None else handler
            signal.signal(number, signal.SIG_IGN if ends_process else restored)


def _ignore(number: int, frame: FrameType | None) -> None:
    """Do nothing. Unlike SIG_IGN this is not inherited by child processes."""
