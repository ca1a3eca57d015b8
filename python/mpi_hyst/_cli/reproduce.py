"""`mpi-hyst reproduce`: the tables and figures of the paper, and further control schemes."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from mpi_hyst._cli.options import command, directory, flag
from mpi_hyst._cli.outputs import Output, check_directory, check_outputs, write_outputs
from mpi_hyst._cli.terminal import command_line, require_report_packages, say, step_bar
from mpi_hyst._paper import published, reproduction
from mpi_hyst._paper.reproduction import Reproduction
from mpi_hyst._report import reproduce as page
from mpi_hyst._report.page import made_with
from mpi_hyst._text import text_table

SEEDS, QUICK_SEEDS = 10, 3


@dataclass(frozen=True)
class Request:
    """Where the files go, and how much is computed."""

    directory: Path = directory("mpi-hyst-reproduce", "the report and results.json")
    quick: bool = flag(help="Use 3 noise seeds instead of 10.")


@command(Request, short_help="Recompute the tables and figures of the paper.")
def reproduce(request: Request) -> None:
    """Recompute the tables and figures of the paper, and compare further control schemes.

    Needs no data.
    """
    say(run(request.directory, quick=request.quick))


def run(directory: Path, *, quick: bool = False) -> str:
    """Compute, write into the directory, and return the main tables."""
    report, results = directory / "report.html", directory / "results.json"
    check_directory(directory)
    if directory.exists():
        check_outputs([report, results])
    require_report_packages("the reproduction")
    with step_bar("reproduce", reproduction.steps()) as advance:
        made = reproduction.compute(QUICK_SEEDS if quick else SEEDS, advance)
    outputs = [
        Output.of(report, page.report(made, made_with(command_line()))),
        Output.of(results, json.dumps(reproduction.as_json(made), indent=1) + "\n"),
    ]
    write_outputs(outputs, directory)
    return "\n\n".join(
        [
            "published and own numbers\n\n" + text_table(*page.compared_rows(_but_the_walk(made))),
            "Fig. 5, the walk\n\n" + text_table(*page.walk_rows(made.models)),
            "largest errors in nm: measured error published and on the simulated plants A1 and P3; "
            "then error of the true position on A1\n\n" + text_table(*page.summary_rows(made)),
            "further schemes on A1 with 16 nm rms of sensor noise: true error in nm, max (rms)\n\n"
            + text_table(*page.scheme_rows(made.outcomes)),
            "reference of 3.3 µm with a drive of ±500 V: true error after saturation\n\n"
            + text_table(*page.saturation_rows(made.saturation)),
            *published.CAVEATS,
            f"medians over {made.seeds} seeds\nreport   {report}\nresults  {results}",
        ]
    )


def _but_the_walk(made: Reproduction) -> list[published.Comparison]:
    return [one for one in made.comparisons if one.figure != "Fig. 5"]
