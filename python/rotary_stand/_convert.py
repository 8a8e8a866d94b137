"""Columns of NumPy, pandas and Arrow objects for the library; the library decides what they mean."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

#: Name, numbers less origin, origin, whether the cells are dates, first cell that is no number (row from 1, text).
Column = tuple[str, npt.NDArray[np.float64], float, bool, "tuple[int, str] | None"]
Pairs = list[tuple[str, str]]
#: Names of the columns, units, sample rate in Hz, notes.
Stated = tuple[Pairs, Pairs, "float | None", Pairs]


def pairs(mapping: Mapping[str, str] | None, name: str) -> Pairs:
    """A mapping of names as pairs; TypeError for anything else."""
    if mapping is None:
        return []
    if not isinstance(mapping, Mapping) or not all(isinstance(word, str) for pair in mapping.items() for word in pair):
        raise TypeError(f"{name} must be a mapping of names to names, for example {{'speed_rpm': 'omega_rad_s'}}")
    return list(mapping.items())


def stated(
    columns: Mapping[str, str] | None, units: Mapping[str, str] | None, sample_rate_Hz: float | None, notes: Mapping[str, str] | None
) -> Stated:
    """What a caller states about a log of another program; TypeError for anything but mappings of names."""
    return pairs(columns, "columns"), pairs(units, "units"), sample_rate_Hz, pairs(notes, "notes")


def path_of(path: str | os.PathLike[str]) -> str:
    """A path as text; TypeError for anything else."""
    text = os.fspath(path)
    if not isinstance(text, str):
        raise TypeError("a path must be text, not bytes")
    return text


def column(name: Any, values: Any) -> Column:
    """One column: numbers and booleans as float64, dates and durations in seconds, anything else cell by cell."""
    if not isinstance(name, str):
        raise TypeError(f"the name of a column must be text, not {name!r}")
    if hasattr(values, "to_numpy"):  # a Series: of pandas with missing values as NaN, with time zones in UTC
        kind = getattr(values.dtype, "kind", "O")
        if getattr(values.dtype, "tz", None) is not None:
            values = values.dt.tz_convert("UTC").dt.tz_localize(None)
        elif kind in "iufb" and hasattr(values, "hasnans"):
            values = values.to_numpy(dtype=np.float64, na_value=np.nan)
    array = np.asarray(values)
    if np.ma.isMaskedArray(values):
        array = np.ma.filled(values.astype(np.float64), np.nan)
    if array.ndim == 2 and 1 in array.shape:  # a column of MATLAB
        array = array.ravel()
    if array.ndim != 1:
        raise ValueError(f"column {name} has {array.ndim} dimensions; a column has one number for each row")
    if array.dtype.kind in "fiub":
        return name, np.ascontiguousarray(array, dtype=np.float64), 0.0, False, None
    if array.dtype.kind == "M":
        known = array[~np.isnat(array)]
        origin = known[0] if known.size else np.datetime64(0, "s")
        since = (origin - np.datetime64(0, "s").astype(origin.dtype)) / np.timedelta64(1, "s")
        return name, (array - origin) / np.timedelta64(1, "s"), float(since), True, None
    if array.dtype.kind == "m":
        return name, array / np.timedelta64(1, "s"), 0.0, True, None
    if array.dtype.kind == "c":
        raise TypeError(f"column {name} has complex numbers; a log has real ones")
    return name, *_cells(array)


def _cells(array: npt.NDArray[Any]) -> tuple[npt.NDArray[np.float64], float, bool, tuple[int, str] | None]:
    """Numbers of cells that are objects or text, NaN where one is missing or is no number; the first one that is no number."""
    numbers = np.full(array.shape, np.nan)
    first: tuple[int, str] | None = None
    for k, cell in enumerate(array):
        if cell is None or cell == "":
            continue
        try:
            numbers[k] = float(cell)
        except (TypeError, ValueError):
            if str(cell) not in ("<NA>", "NaT"):
                first = first or (k + 1, str(cell))
    return numbers, 0.0, False, first


def columns(items: Iterable[tuple[Any, Any]]) -> list[Column]:
    """The columns of a table of equal lengths; ValueError names the column whose length differs."""
    table = [column(name, values) for name, values in items]
    for name, values, *_ in table:
        if values.size != table[0][1].size:
            raise ValueError(f"column {name} has {values.size} rows, column {table[0][0]} has {table[0][1].size}")
    return table


def is_pandas(data: Any) -> bool:
    """A DataFrame of pandas, without an import of pandas."""
    return type(data).__module__.split(".")[0] == "pandas" and hasattr(data, "columns")


def pandas_columns(frame: Any) -> list[Column]:
    """The columns of a DataFrame, and its index where it is not the number of the row."""
    index = frame.index
    is_row_number = type(index).__name__ == "RangeIndex" and index.name is None
    if not is_row_number:
        frame = frame.reset_index()
    return columns((name, frame.iloc[:, k]) for k, name in enumerate(frame.columns))
