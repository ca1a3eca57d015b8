"""The reports: one file that needs nothing else, has every section, and says what was computed."""

from __future__ import annotations

import base64
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import mpi_hyst as mh
import numpy as np
import pytest
from click.testing import CliRunner, Result
from mpi_hyst._cli import demo as demo_command
from mpi_hyst._cli.commands import commands
from mpi_hyst._cli.identify import Request, fit
from mpi_hyst._cli.identify_records import read
from mpi_hyst._paper import demo as chain
from mpi_hyst._paper.reproduction import WALK_INPUT as WALK
from mpi_hyst._paper.reproduction import WALK_THRESHOLDS
from mpi_hyst._report import canvas
from mpi_hyst._report.coupled_play import STAIRCASE, _lives, moves
from mpi_hyst._report.demo import model_errors, tracking_errors
from mpi_hyst._report.page import Card, Table
from mpi_hyst._report.records import evaluate
from mpi_hyst._text import digits, text_table
from pages import assert_fits, page_of

LARGEST = 4_000_000  # bytes


def parsed(path: Path) -> ET.Element:
    """The page, which must be well formed, with no address outside it and no script."""
    text = path.read_text("utf-8")
    assert len(text) < LARGEST
    root = ET.fromstring(text.removeprefix("<!DOCTYPE html>"))
    for element in root.iter():
        assert element.tag not in ("script", "link", "iframe", "object")
        for name in ("src", "href"):
            assert element.get(name, "#").startswith(("#", "data:image/svg+xml;base64,"))
    style = root.findtext("head/style") or ""
    assert "url(" not in style and "@import" not in style
    names = {section.get("id") for section in root.iter("section")}
    assert {link.get("href") for link in root.iter("a")} == {f"#{name}" for name in names}
    for image in root.iter("img"):
        assert image.get("alt")
        assert_self_contained(image.get("src") or "")
    return root


def assert_self_contained(uri: str) -> None:
    svg = base64.b64decode(uri.partition(",")[2]).decode()
    root = ET.fromstring(svg)
    for element in root.iter():
        for name, value in element.attrib.items():
            if name.endswith("href"):
                assert value.startswith(("#", "data:image/png;base64,"))
        assert not element.tag.endswith("script")


def sections(root: ET.Element) -> list[str | None]:
    return [section.get("id") for section in root.iter("section")]


def words(element: ET.Element) -> str:
    return " ".join(" ".join(element.itertext()).split())


def test_the_demo_writes_its_files(demo: tuple[Path, Result]) -> None:
    directory, result = demo
    assert result.exit_code == 0, result.output
    assert result.stderr == "" and result.stdout.startswith("measured: a piezo stack")
    assert {path.name for path in directory.iterdir()} == {
        *("report.html", "stack.json", "modified.json", "conventional.json", "drive.csv"),
        *("identification.csv", "validation.csv", "trajectory.csv"),
    }
    assert str(directory / "report.html") in result.stdout
    assert isinstance(mh.load(directory / "conventional.json"), mh.PrandtlIshlinskii)


def test_the_report_of_the_demo_fits(demo: tuple[Path, Result], tmp_path: Path) -> None:
    assert_fits(demo[0] / "report.html", tmp_path)


def test_the_report_of_the_demo_stands_alone_and_is_complete(demo: tuple[Path, Result]) -> None:
    root = parsed(demo[0] / "report.html")
    assert sections(root) == [
        *("stack", "operator", "loops", "errors", "paper", "residuals", "model", "compensation"),
        *("memory", "next"),
    ]
    assert len(list(root.iter("img"))) == 10
    assert "5.31 % for the conventional model" in words(root)
    assert "depend on data that are not published" in words(root)
    table = words(list(root.iter("table"))[1])  # the first is that of the measured stack
    for heading in ("max (nm)", "rms (nm)", "max (%)", "rms (%)", "base (µm)"):
        assert heading in table


def test_the_numbers_of_the_demo_are_in_its_report_and_table(demo: tuple[Path, Result]) -> None:
    page = words(parsed(demo[0] / "report.html"))
    computed = chain.compute()
    for _, rows in (model_errors(computed), tracking_errors(computed)):
        for row in rows:
            assert all(cell in page and cell in demo[1].stdout for cell in row)


def test_the_demo_shows_what_it_claims() -> None:
    computed = chain.compute()
    learned, unseen = computed.records
    modified = chain.Error.of(
        computed.modelled(computed.modified, unseen) - unseen.position, unseen.position
    )
    conventional = chain.Error.of(
        computed.modelled(computed.conventional, unseen) - unseen.position, unseen.position
    )
    assert modified.rms < 1.5e-3 < 20e-3 < conventional.rms
    assert computed.modified.fit.rmse < 1.02 * chain.NOISE
    assert learned.drive.size == 12_000
    line, closed, table_2, identified, true = (scheme.error.max for scheme in computed.schemes)
    assert true < 1e-12 < identified < 5e-3 < table_2 < closed < line
    assert all(abs(scheme.drive).max() <= 500.0 for scheme in computed.schemes)


def test_the_demo_repeats_itself(demo: tuple[Path, Result], tmp_path: Path) -> None:
    demo_command.run(tmp_path)
    for path in demo[0].iterdir():
        if path.name != "report.html":  # which names the directory
            assert path.read_bytes() == (tmp_path / path.name).read_bytes()


def test_the_commands_that_the_demo_names_work(
    demo: tuple[Path, Result], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    root = parsed(demo[0] / "report.html")
    named = next(root.iter("pre")).text or ""
    for path in demo[0].glob("*.csv"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    monkeypatch.chdir(tmp_path)
    for line in named.replace("\\\n", " ").splitlines():
        program, *arguments = line.split()
        assert program == "mpi-hyst"
        result = CliRunner().invoke(commands, arguments, catch_exceptions=False)
        assert result.exit_code == 0, result.output
    followed = mh.load("stage.json").forward(1e-4).run(_column("stage_drive.csv"))
    # the trajectory begins where the stage rests up to the fitted offset, which fades in 5 ms
    assert np.abs(followed - _column("trajectory.csv"))[51:].max() < 1e-12


def _column(name: str) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.loadtxt(name, delimiter=",", skiprows=1, usecols=1)


def record_csv(path: Path, amplitude: float, *, timed: bool = True, scale: int = 1) -> Path:
    drive = mh.signals.decaying_triangle(amplitude, 1.0, cycles=4 * scale, rate=250.0)
    position = mh.paper.table_1_recovered().forward().run(drive)
    position += 0.5 + np.random.default_rng(1).normal(0.0, 0.01, drive.size)
    header = "time_s,drive_v,position_um" if timed else "drive,position"
    rows = [
        ",".join(map(repr, ([sample / 250.0] if timed else []) + list(pair)))
        for sample, pair in enumerate(zip(drive.tolist(), position.tolist(), strict=True))
    ]
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("kind", ["modified", "conventional"])
def test_the_report_of_an_identification(tmp_path: Path, kind: str) -> None:
    paths = [record_csv(tmp_path / f"{volts}.csv", volts) for volts in (400.0, 300.0)]
    result = CliRunner().invoke(
        commands,
        [
            *("identify", *map(str, paths), "--input", "drive_v", "--output", "position_um"),
            *("--skip", "0.5s", "--report", str(tmp_path / "report.html"), "--model", kind),
        ],
        catch_exceptions=False,
    )
    assert result.exit_code == 0, result.output
    root = parsed(tmp_path / "report.html")
    assert sections(root) == [
        *("loops", "errors", "warnings", "residuals", "left-out", "uncertainty", "chosen", "tried"),
        "model",
    ]
    assert len(list(root.iter("img"))) == 7
    page = words(root)
    for said in ("400.0.csv", "300.0.csv", "drive (V)", "position (µm)", "all records", kind):
        assert said in page


def test_the_report_shows_what_was_held_out_and_how_far_to_trust_it(tmp_path: Path) -> None:
    path = record_csv(tmp_path / "record.csv", 400.0)
    report = tmp_path / "report.html"
    options = ["--operators", "auto", "--weights", "split", "--validate-from", "800"]
    result = CliRunner().invoke(
        commands,
        [
            *("identify", str(path), "--input", "drive_v", "--output", "position_um"),
            *("--report", str(report), *options),
        ],
        catch_exceptions=False,
    )
    assert result.exit_code == 0, result.output
    root = parsed(report)
    assert sections(root) == [
        *("loops", "errors", "warnings", "residuals", "left-out", "uncertainty", "chosen", "tried"),
        "model",
    ]
    request = Request(
        (path,), "drive_v", "position_um", validate_from=("800",),
        operators="auto", weights="split",
    )  # fmt: skip
    records = read(request)
    found = fit(records, request, lambda _fraction, _best: None)
    validation, page = found.validation, words(root)
    assert validation is not None and isinstance(found.model, mh.ModifiedPrandtlIshlinskii)
    left_out = found.leave_one_loop_out(records.fitted[0].input, records.fitted[0].output)
    assert len(left_out) == 2
    for said in (
        *("Validation errors", "NRMSE", digits(validation.rmse, 3), digits(validation.nrmse, 3)),
        *(digits(row.left_out.rmse, 3) for row in left_out),
        *(digits(rmse) for _, rmse in found.cross_validation),
        *(digits(weight, 5) for weight in found.model.weights_negative.tolist()),
        *(digits(std, 2) for std in found.weights_negative_std.tolist() if std > 0.0),
        *(finding.code for finding in found.warnings),
    ):
        assert said in page, said
    assert "v (µm/V)" in page
    figures = [image.get("alt") or "" for image in root.iter("img")]
    assert any("validation" in words for words in figures)


def test_a_report_without_time_or_units(tmp_path: Path) -> None:
    path = record_csv(tmp_path / "plain.csv", 400.0, timed=False)
    report = tmp_path / "report.html"
    result = CliRunner().invoke(
        commands,
        [
            *("identify", str(path), "--input", "drive", "--output", "position"),
            *("--report", str(report), "--skip", "100"),
        ],
        catch_exceptions=False,
    )
    assert result.exit_code == 0, result.output
    assert "µm" not in words(parsed(report))


def test_a_long_record_makes_no_larger_report(tmp_path: Path) -> None:
    path = record_csv(tmp_path / "long.csv", 400.0, scale=60)
    report = tmp_path / "report.html"
    arguments = ["--ratios", "0.95,0.3,0.35", "--dead-time", "0", "--input-offset", "0"]
    result = CliRunner().invoke(
        commands,
        [
            *("identify", str(path), "--input", "drive_v", "--output", "position_um"),
            *("--report", str(report), *arguments),
        ],
        catch_exceptions=False,
    )
    assert result.exit_code == 0, result.output
    page = words(parsed(report))
    assert "Loop width" in page and "No warnings." in page
    assert "warnings: none" in result.stdout


def test_warnings_are_told_by_name_in_the_terminal_and_in_the_report(tmp_path: Path) -> None:
    paths = []
    for name in ("first", "second"):
        drive = mh.signals.sine(400.0, 1.0, seconds=6.0, rate=250.0)
        position = mh.paper.table_1_recovered().forward().run(drive)
        if name == "second":
            position[700] += 0.5
        rows = [f"{u!r},{y!r}" for u, y in zip(drive.tolist(), position.tolist(), strict=True)]
        paths.append(tmp_path / f"{name}.csv")
        paths[-1].write_text("\n".join(["drive_v,position_um", *rows]), encoding="utf-8")
    report = tmp_path / "report.html"
    result = CliRunner().invoke(
        commands,
        [
            *("identify", *map(str, paths), "--input", "drive_v", "--output", "position_um"),
            *("--report", str(report), "--ratios", "0.95,0.3,0.35", "--dead-time", "0"),
            *("--input-offset", "0", "--operators", "16", "--loss", "squares"),
        ],
        catch_exceptions=False,
    )
    assert result.exit_code == 0, result.output
    page = words(parsed(report))
    for said in (
        *("no_minor_loops: 0 reversals", "outliers: second.csv: ", "the furthest sample 700 "),
    ):
        assert said in result.stdout and said in page
    assert "outliers second.csv" in page and "no_minor_loops all" in page


@pytest.mark.parametrize("hold_out", ["nothing", "files", "ends"])
def test_the_residuals_are_those_of_the_fit(tmp_path: Path, hold_out: str) -> None:
    paths, others = (
        tuple(record_csv(tmp_path / f"{volts}.csv", volts) for volts in some)
        for some in ((400.0, 300.0), (350.0, 250.0))
    )
    request = Request(
        paths,
        "drive_v",
        "position_um",
        skip=("50",),
        validate=others if hold_out == "files" else (),
        validate_skip=("20",) if hold_out == "files" else (),
        validate_from=("600", "2.8s") if hold_out == "ends" else (),
    )
    records = read(request)
    found = fit(records, request, lambda _fraction, _best: None)
    fitted, held_out = evaluate(records, found)
    assert [one.record for one in fitted] == records.fitted and len(held_out) == 2 * (
        hold_out != "nothing"
    )
    if hold_out == "ends":
        assert [one.quality.samples for one in (*fitted, *held_out)] == [550, 650, 400, 300]
    for one in (*fitted, *held_out):
        residual = one.residuals(found)[one.record.skip :]
        assert np.sqrt(np.mean(residual**2)) == pytest.approx(one.quality.rmse)
        assert np.abs(residual).max() == pytest.approx(one.quality.max_error)


def test_text_from_files_cannot_break_the_page() -> None:
    nasty = "<script>&\"'"
    table, pairs = Table(nasty, [nasty], [[nasty]]), [(nasty, nasty)]
    text = page_of(nasty, [Card(nasty, nasty, nasty)], table=table, pairs=pairs)
    assert "<script" not in text
    assert nasty in words(ET.fromstring(text.removeprefix("<!DOCTYPE html>")))


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (1.0, "1.000"), (0.0151934, "0.01519"), (-82.98, "-82.98"), (1e-9, "1.000e-09")],
)
def test_digits(value: float, text: str) -> None:
    assert digits(value) == text


def test_text_tables_are_aligned() -> None:
    assert text_table(["name", "max"], [["a", "1.0"], ["longer", "10.0"]]) == (
        "  name     max\n  a        1.0\n  longer  10.0"
    )


def test_an_envelope_loses_no_spike() -> None:
    values = np.zeros(100_000)
    values[[123, 77_777]] = 5.0, -3.0
    kept = canvas.envelope(values, 1000)
    assert kept.size <= 1000
    assert {123, 77_777} <= set(kept.tolist())
    assert np.all(np.diff(kept) > 0)


def test_the_walk_of_fig_5_comes_out_at_any_sampling() -> None:
    way, x = moves(WALK, 0.05)
    corners = np.searchsorted(way, np.concatenate(([0.0], np.cumsum(np.abs(np.diff(WALK))))))
    z = mh.CoupledPlay(*WALK_THRESHOLDS).run(x)
    np.testing.assert_allclose(z[corners], [0, 10, -12, 5, 5, 15, -7, -7], atol=1e-12)


def test_the_memory_figure_shows_the_memory() -> None:
    model = mh.paper.table_1_recovered()
    _, drive = moves(STAIRCASE, 1.0)
    lives, depth = _lives(model, drive)
    stream = model.forward()
    for sample, value in enumerate(drive.tolist()):
        stream.step(value)
        alive = [life[0] for life in sorted(lives, key=lambda life: life[1])
                 if life[1] < sample < life[2]]  # fmt: skip
        remembered = stream.memory.tolist()
        assert depth[sample] == len(remembered)
        if sample not in {at for life in lives for at in (life[1], life[2])}:
            assert alive == remembered
    assert max(depth) == 9
    assert depth[-1] == 0
    assert not re.search("nan", str(lives))
