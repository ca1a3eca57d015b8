"""An EPICS soft IOC: for every axis of a scanner a position to go to, and where it is.

PREFIX:X:GOTO moves and PREFIX:X:POSITION says where the axis is at rest. PREFIX:REFUSED says why
the last motion was refused, and is empty after one that was not.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import mpi_hyst as mh
from softioc import asyncio_dispatcher, builder, softioc
from support_stage import scanner


def records(one: mh.scan.Scanner, write: Callable[[Mapping[str, Any]], object]) -> None:
    """Make the records; `write` puts out the drives of all axes, one for each `one.dt`."""
    refused = builder.longStringIn("REFUSED", initial_value="", length=256)

    def record(axis: str) -> None:
        where = one.positions[axis]
        position = builder.aIn(f"{axis.upper()}:POSITION", EGU="um", PREC=6, initial_value=where)

        def go(wanted: float) -> None:
            try:
                one.run({axis: [wanted, wanted]}, lead_in=0.1, write=write)
            except (ValueError, OSError) as error:
                refused.set(str(error)[:255])
            else:
                refused.set("")
            position.set(one.positions[axis])

        # A second motion to the same place is one: creep has gone on.
        name = f"{axis.upper()}:GOTO"
        builder.aOut(name, EGU="um", PREC=6, initial_value=where, on_update=go, always_update=True)

    for axis in one.axes:
        record(axis)


def serve(
    prefix: str, one: mh.scan.Scanner, write: Callable[[Mapping[str, Any]], object]
) -> asyncio_dispatcher.AsyncioDispatcher:
    """Start the IOC, which runs in threads of its own."""
    dispatcher = asyncio_dispatcher.AsyncioDispatcher()
    builder.SetDeviceName(prefix)
    records(one, write)
    builder.LoadDatabase()
    softioc.iocInit(dispatcher, enable_pva=False)
    return dispatcher


if __name__ == "__main__":
    serve("PIEZO", scanner(), lambda drives: print(len(drives["x"]), "drives"))
    softioc.interactive_ioc(globals())
