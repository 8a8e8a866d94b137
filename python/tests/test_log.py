"""Logs from and to other programs, and the errors of bad ones."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest

import rotary_stand as rs

ROWS = 400


def table(**changes: Any) -> dict[str, Any]:
    t = np.arange(ROWS) * 1e-3
    return {"t_s": t, "u_V": np.sign(np.sin(9 * t)), "omega_rad_s": np.sin(9 * t), **changes}


def same(a: rs.Log, b: rs.Log) -> bool:
    return a.columns == b.columns and all(np.array_equal(a[name], b[name]) for name in a.columns)


def test_log_goes_through_every_format_unchanged(cogging_log: rs.Log, folder: Path) -> None:
    for name in ("log.csv", "log.parquet"):
        cogging_log.write(folder / name)
        back = rs.Log.read(folder / name)
        assert same(back, cogging_log)
        assert back.notes == cogging_log.notes
    assert same(rs.Log.from_pandas(cogging_log.to_pandas()), cogging_log)
    assert rs.Log.from_pandas(cogging_log.to_pandas()).notes == cogging_log.notes
    assert same(rs.Log.from_polars(cogging_log.to_polars()), cogging_log)
    assert same(rs.Log.from_arrow(cogging_log.to_arrow()), cogging_log)
    assert sorted(rs.Log.from_arrow(cogging_log.to_arrow()).notes) == sorted(cogging_log.notes)
    assert same(rs.Log.from_dict(cogging_log.to_dict()), cogging_log)
    cogging_log.to_mat(folder / "log.mat")
    assert same(rs.Log.from_mat(folder / "log.mat"), cogging_log)


def test_columns_share_the_memory_of_the_log(cogging_log: rs.Log) -> None:
    first, second = cogging_log["u_V"], cogging_log["u_V"]
    assert np.shares_memory(first, second)
    assert not first.flags.writeable
    assert cogging_log.to_arrow().column("u_V").chunk(0).buffers()[1].address == first.__array_interface__["data"][0]
    with pytest.raises(ValueError, match="read-only"):
        first[0] = 1.0


def test_column_outlives_its_log() -> None:
    values = rs.Log.from_dict(table())["omega_rad_s"]
    array = pa.table(rs.Log.from_dict(table())).column("omega_rad_s")
    assert np.array_equal(values, table()["omega_rad_s"])
    assert np.array_equal(array.to_numpy(), table()["omega_rad_s"])


def test_integers_float32_booleans_and_read_only_arrays_become_float64() -> None:
    fixed = np.arange(ROWS)
    fixed.setflags(write=False)
    data = table(u_V=np.ones(ROWS, np.int16), omega_rad_s=np.ones(ROWS, np.float32), open_circuit=np.zeros(ROWS, bool), i_A=fixed)
    for source in (data, pd.DataFrame(data), pl.DataFrame(data), pa.table(data)):
        log = rs.Log.of(source)
        assert all(log[name].dtype == np.float64 for name in log)
        assert log["i_A"][-1] == ROWS - 1


def test_strided_and_big_endian_arrays_are_read() -> None:
    two = np.zeros((ROWS, 2))
    two[:, 0] = np.arange(ROWS)
    log = rs.Log.from_dict(table(u_V=two[:, 0], omega_rad_s=np.arange(ROWS).astype(">f8")))
    assert log["u_V"][5] == log["omega_rad_s"][5] == 5


@pytest.mark.parametrize("zone", [None, "Europe/Berlin"])
@pytest.mark.parametrize("index", [False, True])
def test_time_stamps_of_pandas_become_seconds(zone: str | None, index: bool) -> None:
    stamps = pd.date_range("2026-03-29 00:59:59.9", periods=ROWS, freq="1ms", tz=zone)
    frame = pd.DataFrame({"when": stamps, **{k: v for k, v in table().items() if k != "t_s"}})
    frame = frame.set_index("when") if index else frame
    log = rs.Log.from_pandas(frame, columns={"when": "t_s"})
    assert np.allclose(np.diff(log["t_s"]), 1e-3, atol=1e-9)


def test_time_stamps_of_polars_and_arrow_become_seconds() -> None:
    stamps = pd.date_range("2026-03-29", periods=ROWS, freq="1ms", tz="UTC")
    frame = pl.from_pandas(pd.DataFrame({**table(), "t_s": stamps}))
    for source in (frame, frame.to_arrow()):
        assert np.allclose(np.diff(rs.Log.of(source)["t_s"]), 1e-3, atol=1e-9)


def test_mapping_and_units_make_si() -> None:
    t = np.arange(ROWS)
    data = {"time": t, "duty": np.sign(np.sin(0.009 * t)) * 0.5, "speed": np.sin(0.009 * t) * 60 / (2 * np.pi), "comment": ["x"] * ROWS}
    stated: dict[str, Any] = {
        "columns": {"time": "t_s", "duty": "u_V", "speed": "omega_rad_s"},
        "units": {"time": "ms", "duty": "12 V", "speed": "rpm"},
    }
    for source in (data, pd.DataFrame(data), pl.DataFrame(data)):
        log = rs.Log.of(source, **stated)
        assert log["t_s"][-1] == pytest.approx((ROWS - 1) * 1e-3)
        assert log["u_V"].max() == pytest.approx(6.0)
        assert log["omega_rad_s"] == pytest.approx(np.sin(0.009 * t), abs=1e-12)


def test_mapping_of_a_file_leaves_no_file_beside_it(folder: Path) -> None:
    path = folder / "bench.csv"
    path.write_text("Zeit [ms];Spannung [V];Drehzahl [rpm]\n" + "".join(f"{k};{k % 5},5;{k % 7},0\n" for k in range(ROWS)), encoding="latin-1")
    log = rs.Log.read(path, columns={"Zeit [ms]": "t_s", "Spannung [V]": "u_V", "Drehzahl [rpm]": "omega_rad_s"})
    assert log["omega_rad_s"].max() == pytest.approx(6 * 2 * np.pi / 60)
    assert [file.name for file in folder.iterdir()] == ["bench.csv"]


def test_inspection_says_what_columns_are(folder: Path) -> None:
    path = folder / "bench.csv"
    path.write_text("t [ms],U [V],n [rpm]\n" + "".join(f"{k},{k % 5},{k % 7}\n" for k in range(ROWS)))
    assert rs.inspect(path).columns["n [rpm]"] == "omega_rad_s"
    assert rs.inspect(pd.read_csv(path)).columns["t [ms]"] == "t_s"
    assert rs.inspect(pl.read_csv(path)).columns["U [V]"] == "u_V"
    assert "rpm" in str(rs.inspect(path)) and len(rs.inspect(path).to_frame()) == 3


def error_of(source: Any, **arguments: Any) -> rs.LogError:
    with pytest.raises(rs.LogError) as caught:
        rs.Log.of(source, **arguments)
    return caught.value


@pytest.mark.parametrize("make", [dict, pd.DataFrame, pl.DataFrame, pa.table])
def test_errors_name_row_and_column(make: Any) -> None:
    gap = table()["u_V"].copy()
    gap[6] = np.nan
    error = error_of(make(table(u_V=gap)))
    assert (error.path, error.row, error.column) == ("frame", 7, "u_V")
    back = table()["t_s"].copy()
    back[9] = 0.0
    error = error_of(make(table(t_s=back)))
    assert (error.row, error.column) == (10, "t_s") and "steps back" in str(error)
    text = ["1.0"] * ROWS
    text[3] = "n/a"
    error = error_of(make(table(u_V=text)))
    assert (error.row, error.column) == (4, "u_V") and "n/a" in str(error)
    missing = table()
    del missing["t_s"]
    assert "t_s" in str(error_of(make(missing)))
    assert "no rows" in str(error_of(make({"t_s": np.zeros(0), "u_V": np.zeros(0)})))


def test_missing_values_of_extension_types_are_named() -> None:
    values = pd.array([1.0] * ROWS, dtype="Float64")
    values[5] = pd.NA
    assert error_of(pd.DataFrame(table(u_V=values))).row == 6
    assert error_of(pl.DataFrame(table(u_V=[None] + [1.0] * (ROWS - 1)))).row == 1
    arrow = pd.DataFrame(table(u_V=pd.array([1] * ROWS, dtype="int64[pyarrow]")))
    assert rs.Log.from_pandas(arrow)["u_V"][0] == 1.0


def test_duplicate_columns_and_unequal_lengths_are_errors() -> None:
    frame = pd.DataFrame(table())
    assert error_of(pd.concat([frame, frame[["u_V"]]], axis=1)).column == "u_V"
    arrow = pa.table([frame["t_s"], frame["u_V"], frame["u_V"]], names=["t_s", "u_V", "u_V"])
    assert error_of(arrow).column == "u_V"
    with pytest.raises(ValueError, match="u_V has 3 rows"):
        rs.Log.from_dict(table(u_V=np.zeros(3)))


def test_empty_frames_are_errors() -> None:
    assert "t_s" in str(error_of(pd.DataFrame()))
    assert "t_s" in str(error_of(pl.DataFrame()))
    assert "t_s" in str(error_of({}))


@pytest.mark.parametrize("source", [None, 3, "no/such.csv", [1, 2], object()])
def test_wrong_types_are_type_errors(source: Any) -> None:
    with pytest.raises(TypeError):
        rs.Log.of(source)


def test_wrong_arguments_are_errors() -> None:
    for arguments in ({"columns": ["t_s"]}, {"columns": {"a": 1}}, {"units": "ms"}, {"sample_rate_Hz": "fast"}):
        with pytest.raises(TypeError):
            rs.Log.of(table(), **arguments)
    with pytest.raises(TypeError):
        rs.Log.from_dict({1: np.zeros(3)})  # type: ignore[dict-item]
    with pytest.raises(TypeError, match="complex"):
        rs.Log.from_dict(table(u_V=np.zeros(ROWS, complex)))
    with pytest.raises(ValueError, match="2 dimensions"):
        rs.Log.from_dict(table(u_V=np.zeros((ROWS, 3))))
    assert error_of(table(), columns={"nothing": "u_V"}).column == "nothing"
    assert "unit" in str(error_of(table(), units={"u_V": "parsec"}))
    assert "positive" in str(error_of({"u_V": np.zeros(ROWS)}, sample_rate_Hz=-1.0))


def test_time_without_a_unit_is_asked_for() -> None:
    data = {"time": np.arange(ROWS), "u_V": table()["u_V"], "omega_rad_s": table()["omega_rad_s"]}
    message = str(error_of(data, columns={"time": "t_s"}))
    assert "units=" in message or "sample_rate" in message


def test_errors_of_files_have_their_place(folder: Path) -> None:
    (folder / "bad.csv").write_text("t_s,u_V\n0,1\n0.1,x\n")
    with pytest.raises(rs.LogError) as caught:
        rs.Log.read(folder / "bad.csv")
    assert (caught.value.row, caught.value.column) == (2, "u_V")
    assert caught.value.path.endswith("bad.csv")
    for name in ("missing.csv", "log.xlsx"):
        with pytest.raises(rs.LogError):
            rs.Log.read(folder / name)
    with pytest.raises(rs.LogError):
        rs.Log.from_dict(table()).write(folder / "no" / "such" / "folder.csv")
    assert issubclass(rs.LogError, ValueError)


def test_wrapped_angle_is_continued_as_of_a_file() -> None:
    angle = np.mod(np.arange(ROWS) * 0.05, 2 * np.pi)
    log = rs.Log.from_dict(table(theta_rad=angle))
    assert log["theta_rad"][-1] > 6 * np.pi and log.warnings


def test_linear_axis_keeps_its_names() -> None:
    data = {"t_s": np.arange(ROWS) * 1e-3, "force_N": np.ones(ROWS), "v_m_s": np.ones(ROWS)}
    assert rs.Log.from_dict(data).columns == list(data)
    assert rs.Log.from_dict(data)["v_m_s"][0] == 1.0


def test_views_of_a_log(cogging_log: rs.Log) -> None:
    assert "12000 rows" in repr(cogging_log) and "<table>" in cogging_log._repr_html_()
    assert len(cogging_log) == 12000 and cogging_log.duration_s == pytest.approx(12.0)
    assert [(s.start, s.stop) for s in cogging_log.segments] == [(0, 12000)]
    with pytest.raises(KeyError, match="no column"):
        cogging_log["nothing"]


def test_a_log_of_a_log_keeps_its_notes(null_log: rs.Log) -> None:
    again = rs.Log.of(null_log, notes={"stand": "2"})
    assert dict(again.notes)["stand"] == "2"
    kept = [note for note in null_log.notes if note[0] != "stand"]
    assert kept and all(note in again.notes for note in kept)
    assert np.array_equal(again["omega_rad_s"], null_log["omega_rad_s"])
