"""The scripts of the public benchmarks read official layouts of files, and name what is wrong."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import scipy.io
from support import Array

FOLDER = Path(__file__).parents[1] / "benches" / "benchmarks"


@pytest.fixture(scope="module", params=["steering_mirror", "bouc_wen"])
def script(request: pytest.FixtureRequest) -> ModuleType:
    return loaded(request.param)


def loaded(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"benchmark_{name}", FOLDER / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # annotations of its records are looked up there
    spec.loader.exec_module(module)
    return module


def test_help_tells_of_the_official_files(
    script: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["script", "--help"])
    with pytest.raises(SystemExit):
        script.main()
    assert "--official" in capsys.readouterr().out


# ---- the fine steering mirror: one .npy for each signal, amplitude and part


def mirror(folder: Path, part: str = "train", samples: int = 150) -> tuple[Array, Array]:
    """Write two amplitudes of one part: two realisations of three periods; return the second."""
    rng = np.random.default_rng(3)
    for amplitude in (100, 200):
        u = np.repeat(rng.standard_normal((samples, 3, 2, 1)), 3, axis=3)
        y = rng.standard_normal(u.shape)
        np.save(folder / f"u_{amplitude}mV_{part}.npy", u)
        np.save(folder / f"y_{amplitude}mV_{part}.npy", y)
    return u, y


def test_official_files_of_the_mirror_are_records_of_periods(tmp_path: Path) -> None:
    script = loaded("steering_mirror")
    u, y = mirror(tmp_path)
    mirror(tmp_path, "test")
    records = script.official(tmp_path, "train")
    assert [record.u.shape for record in records] == [(450, 3)] * 4
    assert {record.periods for record in records} == {3}
    for r in range(2):
        one = records[2 + r]
        for p in range(3):
            rows = slice(150 * p, 150 * (p + 1))
            assert (one.u[rows] == u[:, :, r, p]).all() and (one.y[rows] == y[:, :, r, p]).all()
    # The figure, written out: a model that does nothing misses all of a position.
    none = {"bw": np.zeros((1, 0)), "cq": np.zeros((0, 1)), "dq": np.zeros((0, 3)), "operators": []}
    still = script.mh.MultiAxisStage(
        [[0.5]], np.zeros((1, 3)), np.zeros((3, 1)), np.zeros((3, 3)), **none, dt=1.0 / 6400.0
    )
    of_all = [
        np.sqrt((y[100:, i, r, p] ** 2).mean()) / y[100:, i, r, p].std()
        for i in range(3)
        for r in range(2)
        for p in range(3)
    ]
    assert script.error(still, records[2:]) == pytest.approx(100.0 * np.mean(of_all))


def test_other_files_of_the_mirror_are_read(tmp_path: Path) -> None:
    script = loaded("steering_mirror")
    rng = np.random.default_rng(4)
    u, y = rng.standard_normal((2, 120, 3, 2))
    np.savez(tmp_path / "a.npz", u=u, y=y)
    scipy.io.savemat(tmp_path / "a.mat", {"u": u, "y": y})
    rows = np.hstack([u[:, :, 0], y[:, :, 0]])
    np.savetxt(tmp_path / "a.csv", rows, delimiter=",", header="u1,u2,u3,y1,y2,y3", fmt="%.17g")
    for name, count in (("a.npz", 2), ("a.mat", 2), ("a.csv", 1)):
        records = script.read(tmp_path / name)
        assert len(records) == count
        assert (records[0].u == u[:, :, 0]).all() and (records[0].y == y[:, :, 0]).all()


@pytest.mark.parametrize(
    ("u", "y", "message"),
    [
        ((150, 2, 2, 3), (150, 2, 2, 3), r"u_1mV_train\.npy: expected u and y of one shape"),
        ((150, 3, 2, 3), (150, 3, 2, 2), r"got \(150, 3, 2, 3\) and \(150, 3, 2, 2\)"),
        ((90, 3, 2, 3), (90, 3, 2, 3), "more than 100 samples"),
        ((150, 3, 3, 2), (150, 3, 3, 2), "expected periods of the same drives along the last axis"),
    ],
)
def test_a_wrong_layout_of_the_mirror_is_named(
    tmp_path: Path, u: tuple[int, ...], y: tuple[int, ...], message: str
) -> None:
    drives = np.random.default_rng(5).standard_normal(u)
    if u != (150, 3, 3, 2):
        drives[:] = drives[..., :1]
    np.save(tmp_path / "u_1mV_train.npy", drives)
    np.save(tmp_path / "y_1mV_train.npy", np.ones(y))
    with pytest.raises(ValueError, match=message):
        loaded("steering_mirror").official(tmp_path, "train")


def test_files_of_the_mirror_that_lack_something_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    script = loaded("steering_mirror")
    with pytest.raises(ValueError, match=r"expected files u_\*_test\.npy in or below it, got none"):
        script.official(tmp_path, "test")
    mirror(tmp_path)
    (tmp_path / "y_200mV_train.npy").unlink()
    with pytest.raises(ValueError, match=r"y_200mV_train\.npy: expected the positions to u_200mV"):
        script.official(tmp_path, "train")
    np.savez(tmp_path / "a.npz", u=np.ones((120, 3)), position=1.0)
    with pytest.raises(ValueError, match=r"a\.npz: expected arrays u and y, got position, u"):
        script.read(tmp_path / "a.npz")
    np.savetxt(tmp_path / "a.csv", np.ones((120, 5)), delimiter=",", header="a")
    with pytest.raises(ValueError, match=r"a\.csv: expected 6 columns, got 5"):
        script.read(tmp_path / "a.csv")
    with pytest.raises(ValueError, match=r"expected a file \.npz, \.mat or \.csv, got '\.txt'"):
        script.read(tmp_path / "a.txt")
    monkeypatch.setattr(sys, "argv", ["script", "--official", str(tmp_path / "none")])
    with pytest.raises(SystemExit):
        script.main()
    assert "expected files u_*_train.npy in or below it, got none" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["a.npz", "a.mat", "a.csv", "u_100mV_train.npy"])
def test_a_file_of_the_mirror_that_is_no_such_file_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    path = str(tmp_path / name)
    for bad in (tmp_path / name, tmp_path / name.replace("u_", "y_")):
        bad.write_text("no numbers\nhere\n")
    files = ["--training", path, "--test", path]
    files = ["--official", str(tmp_path)] if name.endswith("npy") else files
    monkeypatch.setattr(sys, "argv", ["script", *files])
    with pytest.raises(SystemExit):
        loaded("steering_mirror").main()
    assert f"{path}: expected a file {path[-4:]} as its name says, got:" in capsys.readouterr().err


def test_records_of_the_mirror_that_cannot_be_fitted_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, u=np.ones((200, 3)), y=np.ones((200, 3)))
    monkeypatch.setattr(sys, "argv", ["script", "--training", str(path), "--test", str(path)])
    with pytest.raises(SystemExit):
        loaded("steering_mirror").main()
    assert "error: u" in capsys.readouterr().err


def test_the_mirror_takes_official_files_or_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    both = ["--official", str(tmp_path), "--training", "a.npz", "--test", "b.npz"]
    monkeypatch.setattr(sys, "argv", ["script", *both])
    with pytest.raises(SystemExit):
        loaded("steering_mirror").main()
    assert "--official: expected no --training and --test beside it" in capsys.readouterr().err


# ---- Bouc-Wen: one .mat for each signal, of a row or a column of that name


def bouc_wen(folder: Path) -> dict[str, Array]:
    rng = np.random.default_rng(6)
    signals: dict[str, Array] = {}
    for key, size in (("multisine", 64), ("sinesweep", 100)):
        for kind in "uy":
            name = f"{kind}val_{key}"
            signals[name] = rng.standard_normal(size)
            shape = (1, -1) if kind == "u" else (-1, 1)
            scipy.io.savemat(folder / f"{name}.mat", {name: signals[name].reshape(shape)})
    return signals


def test_official_files_of_bouc_wen_are_read(tmp_path: Path) -> None:
    signals = bouc_wen(tmp_path)
    (_, u, y, settle), (_, swept_u, swept_y, from_rest) = loaded("bouc_wen").official(tmp_path)
    assert (u == signals["uval_multisine"]).all() and (y == signals["yval_multisine"]).all()
    assert (swept_u == signals["uval_sinesweep"]).all()
    assert (swept_y == signals["yval_sinesweep"]).all()
    assert (settle, from_rest) == (1, None)


def test_a_wrong_layout_of_bouc_wen_is_named(tmp_path: Path) -> None:
    script = loaded("bouc_wen")
    bouc_wen(tmp_path)
    path = tmp_path / "yval_sinesweep.mat"
    scipy.io.savemat(path, {"yval_sinesweep": np.ones(99)})
    with pytest.raises(ValueError, match=r"expected as many numbers in .* got 100 and 99"):
        script.official(tmp_path)
    scipy.io.savemat(path, {"yval_sinesweep": np.append(np.ones(99), np.inf)})
    with pytest.raises(ValueError, match=r"yval_sinesweep\.mat: expected finite numbers, got inf$"):
        script.official(tmp_path)
    scipy.io.savemat(path, {"y": np.ones(100)})
    with pytest.raises(ValueError, match=r"yval_sinesweep\.mat: expected an array .*, got y$"):
        script.official(tmp_path)
    path.write_text("u,y\n" * 100, "utf-8")
    with pytest.raises(ValueError, match=r"yval_sinesweep\.mat: expected a MATLAB file of version"):
        script.official(tmp_path)
    path.write_bytes(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + bytes(384))
    with pytest.raises(ValueError, match=r"yval_sinesweep\.mat: expected a MATLAB file of version"):
        script.official(tmp_path)
    path.unlink()
    with pytest.raises(ValueError, match=r"expected one file yval_sinesweep\.mat .*, got none"):
        script.official(tmp_path)
    with pytest.raises(ValueError, match=r"uval_multisine\.mat: expected a folder"):
        script.official(tmp_path / "uval_multisine.mat")


def test_the_unpacked_archive_of_bouc_wen_is_a_folder(tmp_path: Path) -> None:
    script = loaded("bouc_wen")
    below = tmp_path / "BoucWenFiles" / "Test signals" / "Validation signals"
    below.mkdir(parents=True)
    signals = bouc_wen(below)
    (_, u, _, _), _ = script.official(tmp_path)
    assert (u == signals["uval_multisine"]).all()
    bouc_wen(tmp_path)
    with pytest.raises(ValueError, match=r"expected one file uval_multisine\.mat .*, got .*, "):
        script.official(tmp_path)


def test_what_bouc_wen_says_of_official_files_is_true(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    script = loaded("bouc_wen")
    bouc_wen(tmp_path)
    monkeypatch.setattr(script, "sweep", lambda: None)
    monkeypatch.setattr(script, "run", lambda *_: None)
    told = []
    for arguments in ([], ["--official", str(tmp_path)]):
        monkeypatch.setattr(sys, "argv", ["script", *arguments])
        script.main()
        told.append(capsys.readouterr().out.splitlines()[0])
    assert "(no official records)" in told[0]
    assert "(judged on the official tests too)" in told[1]
