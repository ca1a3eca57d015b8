"""Files as instruments and programs of many labs write them, made of one record.

Each is right, or refused with the reason, or what was assumed is doubtful.
"""

from __future__ import annotations

from pathlib import Path

import mpi_hyst as mh
import numpy as np
import pytest

FIT = mh.io.read(Path(__file__).parent / "files" / "fit_um.csv")
T, U, Y = FIT["Time"], FIT["Drive"], FIT["Gauge"]
N = T.size
RIGHT, DOUBTFUL = "right", "doubtful"


def rows(*columns: np.ndarray, separator: str = ",", form: str = "{:.6g}", end: str = "\n") -> str:
    table = zip(*(column.tolist() for column in columns), strict=True)
    return "".join(separator.join(map(form.format, row)) + end for row in table)


def counted(*columns: np.ndarray, quote: str = "") -> str:
    lines = rows(*columns).splitlines()
    return "".join(f"{quote}{k + 1}{quote},{line}\n" for k, line in enumerate(lines))


def comma(text: str) -> str:
    return text.replace(".", ",")


TEK = [
    *("Record Length,136", "Sample Interval,0.01", "Trigger Point,50", ",", "Source,CH1"),
    *("Vertical Units,V", "Vertical Scale,2", "Horizontal Units,s", "Firmware Version,FV:v24"),
]
GCS = (
    "# REM\n# VERSION = 1\n# SEPARATOR = 9\n# SAMPLE_TIME = 0.010000\n# NDATA = 136\n#\n"
    "# NAME0 = Voltage of OutputChan1\n# NAME1 = Current Position of axis1\n#\n# END_HEADER\n"
)
STAMP = "2026-11-22 10:00:{:06.3f}+01:00"

# The text, what comes of it, the columns of drive and position, their units, the factors that lead
# to V and um over all of the file, and the sampling interval.
Case = tuple[str | bytes, str, tuple[str, str], tuple[str, str], tuple[float, float], float | None]
VOLTS, SCOPE = ("V", "V"), (12.0, 3.0)
CASES: dict[str, Case] = {
    "Rigol, counted samples": (
        "X,CH1,CH2,Start,Increment\nSequence,Volt,Volt,-5.0e-01,1.0e-02\n"
        + rows(np.arange(N), U / 12, Y / 3, end=",\n"),
        RIGHT, ("CH1", "CH2"), VOLTS, SCOPE, 0.01,
    ),
    "Rigol, times": (
        "Time(s),CH1(V),CH2(V)\n" + rows(T - 0.5, U / 12, Y / 3),
        RIGHT, ("CH1(V)", "CH2(V)"), VOLTS, SCOPE, 0.01,
    ),
    "Rigol, glued units": (
        "Time(s),CH1V,CH2V,t0 = -5.0e-01, tInc = 1.0e-02,\n" + rows(T, U / 12, Y / 3, end=",,\n"),
        DOUBTFUL, ("CH1V", "CH2V"), ("", ""), SCOPE, 0.01,
    ),
    "Siglent": (
        "Record Length,Analog:136\nSample Interval,Analog:1.0E-02\nVertical Units,CH1:V,CH2:V\n"
        "Horizontal Units,s\nModel Number,SDS1204X-E\nSource,CH1,CH2\nSecond,Volt,Volt\n"
        + rows(T - 0.5, U / 12, Y / 3, form="{:.5f}"),
        RIGHT, ("CH1", "CH2"), VOLTS, SCOPE, 0.01,
    ),
    "Yokogawa": (
        '"Model Name","DL850E"\n"TraceName","Drive","Gauge"\n"BlockSize",136,136\n'
        '"VUnit","V","nm"\n"SampleRate",100,100\n"HResolution",0.01\n"HUnit","s","s"\n\n'
        + "".join(f",{line}\n" for line in rows(U, 1e3 * Y).splitlines()),
        RIGHT, ("Drive", "Gauge"), ("V", "nm"), (1.0, 1e-3), None,
    ),
    "PicoScope": (
        "Time,Channel A,Channel B\n(ms),(V),(mV)\n\n" + rows(1e3 * T, U / 12, 1e3 * Y / 3),
        RIGHT, ("Channel A", "Channel B"), ("V", "mV"), (12.0, 3e-3), 0.01,
    ),
    "settings beside the numbers": (
        "".join(
            f"{TEK[k] if k < len(TEK) else ','},,{line},\n"
            for k, line in enumerate(rows(T - 0.5, U / 12, form="{:.6f}").splitlines())
        ),
        RIGHT, ("4", "4"), VOLTS, (12.0, np.nan), 0.01,
    ),
    "PI GCS array": (
        GCS + rows(U, Y, separator="\t"),
        RIGHT, ("Voltage of OutputChan1", "Current Position of axis1"), ("", ""), (1.0, 1.0), None,
    ),
    "German": (
        "Zeit in ms;Spannung in Volt;Weg in Nanometer\n"
        + comma(rows(1e3 * T, U, 1e3 * Y, separator=";")),
        RIGHT, ("Spannung in Volt", "Weg in Nanometer"), ("V", "nm"), (1.0, 1e-3), 0.01,
    ),
    "French": (
        "Temps (secondes);Tension (volts);Déplacement (micromètres)\n"
        + comma(rows(T, U, Y, separator=";")),
        RIGHT, ("Tension (volts)", "Déplacement (micromètres)"), ("V", "um"), (1.0, 1.0), 0.01,
    ),
    "Spanish": (
        "Tiempo, s;Voltaje, V;Posición, nm\n" + rows(T, U, 1e3 * Y, separator=";"),
        RIGHT, ("Voltaje, V", "Posición, nm"), ("V", "nm"), (1.0, 1e-3), 0.01,
    ),
    "Italian": (
        "Tempo (ms)\tTensione (V)\tPosizione (nanometri)\n"
        + rows(1e3 * T, U, 1e3 * Y, separator="\t"),
        RIGHT, ("Tensione (V)", "Posizione (nanometri)"), ("V", "nm"), (1.0, 1e-3), 0.01,
    ),
    "Chinese": (
        "时间(ms),电压(V),位移(nm)\n" + rows(1e3 * T, U, 1e3 * Y),
        RIGHT, ("电压(V)", "位移(nm)"), ("V", "nm"), (1.0, 1e-3), 0.01,
    ),
    "stamps with a zone": (
        "Timestamp,Drive (V),Pos (um)\n"
        + "".join(
            f"{STAMP.format(t)},{line}\n"
            for t, line in zip(T, rows(U, Y).splitlines(), strict=True)
        ),
        RIGHT, ("Drive (V)", "Pos (um)"), ("V", "um"), (1.0, 1.0), 0.01,
    ),
    "date and time apart": (
        "Date;Time;Drive [V];Pos [nm]\n"
        + "".join(
            f"22.11.2026;{comma(f'10:00:{t:06.3f}')};{comma(line)}\n"
            for t, line in zip(T, rows(U, 1e3 * Y, separator=";").splitlines(), strict=True)
        ),
        RIGHT, ("Drive [V]", "Pos [nm]"), ("V", "nm"), (1.0, 1e-3), 0.01,
    ),
    "named channels in rows": (
        "".join(
            f"{name},{','.join(f'{v:.6g}' for v in values)}\n"
            for name, values in (("Time (s)", T), ("Drive (V)", U), ("Gauge (nm)", 1e3 * Y))
        ),
        RIGHT, ("Drive (V)", "Gauge (nm)"), ("V", "nm"), (1.0, 1e-3), 0.01,
    ),
    "channels in rows without names": (
        "".join(" ".join(f"{v:.6g}" for v in values) + "\n" for values in (U, Y)),
        DOUBTFUL, ("0", "1"), ("", ""), (1.0, 1.0), None,
    ),
    "names of rows in quotation marks": (
        '"time_s" "drive_v" "position_um"\n' + counted(T, U, Y, quote='"').replace(",", " "),
        RIGHT, ("drive_v", "position_um"), ("V", "um"), (1.0, 1.0), 0.01,
    ),
    "names of rows without": (
        "time_s drive_v position_nm\n" + counted(T, U, 1e3 * Y).replace(",", " "),
        DOUBTFUL, ("2", "3"), ("", ""), (1.0, 1e-3), None,
    ),
    "units above the names": (
        "s,V,nm\nTime,Drive,Gauge\n" + rows(T, U, 1e3 * Y),
        RIGHT, ("Drive", "Gauge"), ("V", "nm"), (1.0, 1e-3), 0.01,
    ),
    "units in a comment": (
        "# units: s, V, nm\ntime,drive,gauge\n" + rows(T, U, 1e3 * Y),
        RIGHT, ("drive", "gauge"), ("V", "nm"), (1.0, 1e-3), 0.01,
    ),
    "names behind an empty cell": (
        ",0,1,2\n" + counted(T, U, Y),
        RIGHT, ("1", "2"), ("", ""), (1.0, 1.0), None,
    ),
    "header of other separators": (
        "time_s;drive_v;position_um\n" + rows(T, U, Y),
        RIGHT, ("drive_v", "position_um"), ("V", "um"), (1.0, 1.0), 0.01,
    ),
    "glued words": (
        "tSec  driveVolt  posNm\n" + rows(T, U, 1e3 * Y, separator="  "),
        DOUBTFUL, ("driveVolt", "posNm"), ("", ""), (1.0, 1e-3), None,
    ),
    "a letter of an axis": (
        "Time(s),Drive(V),PosFbk(A)\n" + rows(T, U, Y),
        DOUBTFUL, ("Drive(V)", "PosFbk(A)"), ("V", ""), (1.0, 1.0), 0.01,
    ),
    "a line that says the separator": (
        "\ufeffsep=;\nTime (s);Drive (V);Gauge (nm)\n" + rows(T, U, 1e3 * Y, separator=";"),
        RIGHT, ("Drive (V)", "Gauge (nm)"), ("V", "nm"), (1.0, 1e-3), 0.01,
    ),
    "UTF-16 without a mark": (
        ("Zeit (ms);Weg (µm);Spannung (V)\n" + rows(1e3 * T, Y, U, separator=";")).encode(
            "utf-16-le"
        ),
        RIGHT, ("Spannung (V)", "Weg (µm)"), ("V", "um"), (1.0, 1.0), 0.01,
    ),
    "stamps in pairs": (
        rows(0.02 * (np.arange(N) // 2), U, Y, separator="\t"),
        DOUBTFUL, ("1", "2"), ("", ""), (1.0, 1.0), None,
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", CASES)
def test_it_is_right_or_doubtful(kind: str, tmp_path: Path) -> None:
    content, outcome, columns, units, factors, dt = CASES[kind]
    path = tmp_path / "record.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    record = mh.io.read(path)
    doubts = [one.text for one in record.assumed if one.level == "doubtful"]
    assert bool(doubts) == (outcome == DOUBTFUL), doubts
    assert tuple(record.quantity(one).suffix for one in columns) == units
    assert record.sample_time == (dt and pytest.approx(dt))
    for name, factor, expected in zip(columns, factors, (U, Y), strict=True):
        if np.isfinite(factor):
            np.testing.assert_allclose(factor * record[name], expected, rtol=1e-4, atol=1e-3)


REFUSED = {
    "an error of a spreadsheet": (
        "position_um;drive_v\n" + comma(rows(Y, U, separator=";")) + "#WERT!;1,5\n",
        "line 138, column position_um: not a number: '#WERT!'",
    ),
    "decimal commas between commas, no header": (
        comma(rows(T, U, Y, form="{:.3f}")),
        "line 1: every second cell is a whole number of constant width: decimal commas",
    ),
    "a last line of words": (
        "time_s,drive_v,position_um\n" + rows(T, U, Y) + "\nEnd of record\n",
        "line 139: expected 3 cells as in the header, line 1, got 1",
    ),
    "a mean at the end": (
        "time_s,drive_v,position_um\n" + rows(T, U, Y) + "Mean,60,12\n",
        "line 138, column time_s: not a number: 'Mean'",
    ),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_it_is_refused(kind: str, tmp_path: Path) -> None:
    content, said = REFUSED[kind]
    (tmp_path / "record.csv").write_text(content, encoding="utf-8")
    with pytest.raises(mh.io.ReadError, match=said):
        mh.io.read(tmp_path / "record.csv")


def test_a_column_that_is_not_read_is_told(tmp_path: Path) -> None:
    cells = "".join(f'{u:.2f},"{1e3 * y:,.0f}"\n' for u, y in zip(U, Y, strict=True))
    (tmp_path / "record.csv").write_text(f"Drive (V),Gauge (nm)\n{cells}", encoding="utf-8")
    (said,) = [
        one.text for one in mh.io.read(tmp_path / "record.csv").assumed if "not read" in one.text
    ]
    assert "not read: Gauge (nm)" in said and "no separators of thousands" in said
