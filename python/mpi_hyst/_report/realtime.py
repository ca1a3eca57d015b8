"""What a loop in real time did, as names and values and as a table of its times."""

from __future__ import annotations

import mpi_hyst as mh


def facts(report: mh.realtime.LoopReport) -> list[tuple[str, str]]:
    """Return how it ended, what was counted, and the machine."""
    values = report.to_dict()
    machine, counts, datagrams = values["machine"], values["counts"], values["datagrams"]
    end = report.end.replace("_", " ")
    rest = "at the rest drive" if report.at_rest else f"NOT at rest, at {report.last_drive:g}"
    sent = [] if datagrams is None else [("datagrams", _counted(datagrams))]
    return [
        ("end", f"{end}, {rest}, after {report.seconds:.3f} s"),
        ("samples", f"{report.taken}, {report.skipped} deadlines skipped"),
        ("missed deadlines", f"{report.missed}, {report.late} samples began that late"),
        ("stale measurements", f"{report.stale}"),
        ("faults", f"{counts['read_faults']} of reading, {counts['write_faults']} of writing"),
        *sent,
        ("machine", f"{machine['cpu']}, {machine['processors']} processors, {machine['system']}"),
    ]


def _counted(counts: dict[str, int]) -> str:
    return ", ".join(f"{count} {name}" for name, count in counts.items())


def times(report: mh.realtime.LoopReport) -> tuple[list[str], list[list[str]]]:
    """Return latency, computing time and period as a table."""
    header = ["µs", "median", "p99", "p99.9", "p99.99", "max"]
    named = [("latency", report.latency), ("compute", report.compute), ("period", report.period)]
    rows = [
        [name]
        + [
            f"{1e6 * time:.2f}"
            for time in (times.median, times.p99, times.p999, times.p9999, times.max)
        ]
        for name, times in named
    ]
    return header, rows
