"""Any bytes as a record: what `make fuzz` runs under atheris, guided by coverage."""

from __future__ import annotations

import sys
import tempfile
import unicodedata
from pathlib import Path

SUFFIXES = (".csv", ".txt", ".tsv", ".lvm", ".npy", ".npz", ".mat", ".csv.gz")
"""What the first byte chooses from: text is by far the most likely."""

LONGEST_MESSAGE = 1000
"""A message is for a person, however long the line that is wrong."""


def take(data: bytes, folder: Path) -> bool:
    """Read the bytes as a record. Return whether they are one.

    Columns are finite numbers of one length, or there is an error of one line that can be shown.
    """
    import mpi_hyst as mh
    import numpy as np

    suffix = SUFFIXES[data[0] % len(SUFFIXES) if data[:1] >= b"\xf0" else 0] if data else ".csv"
    path = folder / f"record{suffix}"
    path.write_bytes(data[1:])
    try:
        record = mh.io.read(path)
    except mh.io.ReadError as error:
        text = str(error)
        assert text, "an error says what is wrong"
        assert len(text) <= LONGEST_MESSAGE, f"a message of {len(text)} characters"
        control = [c for c in text if unicodedata.category(c) in ("Cc", "Cf", "Cs", "Zl", "Zp")]
        assert not control, f"a message with {control!r}"
        return False
    columns = list(record.values.values())
    lengths = {len(column) for column in columns}
    assert len(lengths) == 1, f"columns of {lengths} rows"
    assert all(column.dtype == np.float64 for column in columns), "columns of numbers"
    assert all(np.isfinite(column).all() for column in columns), "finite numbers"
    return True


def main() -> None:
    """Fuzz without end, with the arguments of libFuzzer."""
    import atheris

    with atheris.instrument_imports(include=["mpi_hyst._io"]):
        import mpi_hyst._io.read  # noqa: F401  (what is imported here is instrumented)

    with tempfile.TemporaryDirectory() as folder:
        atheris.Setup(sys.argv, lambda data: take(data, Path(folder)) and None)
        atheris.Fuzz()


if __name__ == "__main__":
    main()
