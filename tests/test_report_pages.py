"""Reports in a headless browser: nothing of them reaches beyond a desk screen, a phone or paper."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from commands import COLUMNS, HEADER, record_rows, run, write_csv
from mpi_hyst._report.page import Card, Table, Verdict
from pages import WIDTHS, assert_fits, overflow, page_of

LONG = "a_name_without_any_space_" * 8
NAME = "decaying_triangle_of_a_stage_on_a_rather_long_day_in_november_2026.csv"


def identified(directory: Path) -> Path:
    paths = [write_csv(directory / NAME, HEADER, record_rows())]
    paths.append(write_csv(directory / "second.csv", HEADER, record_rows(300.0)))
    report = directory / "report.html"
    options = ["--report", str(report), "--compare", "--operators", "auto"]
    run("identify", *map(str, paths), *COLUMNS, *options, "--validate-from", "800")
    return report


def simulated(directory: Path) -> Path:
    mh.paper.plant("A1").stage.save(directory / "stage.json")
    target = 1.2 * np.sin(np.arange(600) / 20.0)
    rows = [[sample / 2000, value] for sample, value in enumerate(target.tolist())]
    path = write_csv(directory / NAME, "time_s,target_um", rows)
    report = directory / "report.html"
    run("simulate", str(directory / "stage.json"), str(path), "--report", str(report))
    return report


def planned(directory: Path) -> Path:
    shape = ["--limits=-100,100", "--slew", "4000", "--rate", "1000"]
    run("excite", *shape, "--out", str(directory / "plan"))
    return directory / "plan" / "plan.html"


def demagnetized(directory: Path) -> Path:
    report = directory / "report.html"
    shape = ["--limits=-100,100", "--slew", "4000", "--rate", "4000", "--demagnetize"]
    run("excite", *shape, "--out", str(directory / "drive.csv"), "--report", str(report))
    return report


def from_python(directory: Path) -> Path:
    drive = mh.signals.decaying_triangle(500.0, 1.0, cycles=4, rate=200)
    position = mh.paper.table_1_recovered().forward().run(drive)
    found = mh.identify(drive, position, operators=5, input_offset=0.0, dead_time=0.0)
    found.report(directory / "report.html", names=[NAME], units=("V", "um"))
    return directory / "report.html"


MAKERS = (identified, simulated, planned, demagnetized, from_python)


@pytest.mark.parametrize("make", MAKERS)
def test_a_report_fits_screen_and_paper(make: Callable[[Path], Path], tmp_path: Path) -> None:
    assert_fits(make(tmp_path), tmp_path)


def page(**blocks: Any) -> str:
    verdict = Verdict("amber", LONG, [LONG])
    cards, made = [Card(LONG, LONG, LONG)] * 6, [("data", LONG)]
    return page_of(LONG, cards, verdict=verdict, provenance=made, **blocks)


def test_long_names_and_wide_tables_fit_too(tmp_path: Path) -> None:
    wide = Table(LONG, [LONG] * 12, [[LONG] * 12] * 3, LONG)
    text = page(table=wide, best=[1], pairs=[(LONG, LONG)], lines=LONG * 4)
    for width in WIDTHS:
        assert overflow(text, width, tmp_path) == []


@pytest.mark.parametrize("width", WIDTHS)
def test_what_is_too_wide_is_found(width: int, tmp_path: Path) -> None:
    text = page().replace("</main>", f'<div style="width:{width + 9}px">much too wide</div></main>')
    assert any("much too wide" in one for one in overflow(text, width, tmp_path))
    text = page().replace("<body>", f'<body style="min-width:{width + 9}px">')
    assert overflow(text, width, tmp_path) != []
