"""CSV files that the commands write; `_io` reads them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mpi_hyst._types import Samples


def write_table(columns: Mapping[str, Sequence[float] | Samples]) -> str:
    """Return the text of a CSV file. Every number reads back to the same bits."""
    lines = [",".join(_quoted(name) for name in columns)]
    lists = [np.asarray(column).tolist() for column in columns.values()]
    lines.extend(",".join(map(repr, row)) for row in zip(*lists, strict=True))
    return "\n".join(lines) + "\n"


def _quoted(name: str) -> str:
    return f'"{name.replace(chr(34), chr(34) * 2)}"' if set(name) & set(',"\r\n') else name
