"""Logs: recorded columns in SI units, from and to files, pandas, polars, Arrow, NumPy and MATLAB."""

from __future__ import annotations

import html
import os
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _convert, _native
from ._frames import needed
from .answers import Inspection

if TYPE_CHECKING:
    import pandas
    import polars
    import pyarrow

#: Rows that ``_repr_html_`` shows.
_SHOWN_ROWS = 5


class Log:
    """A log: columns of equal length, one number for each row, and notes on how they were made. It does not change.

    Columns of the project have fixed names with their SI unit: ``t_s`` (s, increasing), ``u_V``, ``i_A``, ``omega_rad_s``, ``theta_rad``, … Other names are the
    user's own, for expressions of a model. Every number is finite.

    The arguments of the functions that make a log of data with other names:

    ``columns``: name in the data to name of the project, ``{"speed_rpm": "omega_rad_s"}``; ``"-"`` leaves a column out.
    ``units``: name in the data to its unit, ``{"t": "ms", "enc": "counts:8192"}``; without one, the unit in the name, or else the SI unit.
    ``sample_rate_Hz``: rows per second of data without a time.
    ``notes``: how columns were made, ``{"u_V": "terminal"}`` (docs/logs-and-models.md).

    All of them raise :class:`~rotary_stand.LogError` with ``path``, ``row`` and ``column``.
    """

    __slots__ = ("_native",)

    def __init__(self, native: _native.Log) -> None:
        if not isinstance(native, _native.Log):
            raise TypeError("make a log with Log.read, Log.of, Log.from_pandas, Log.from_polars, Log.from_arrow, Log.from_dict or Log.from_mat")
        self._native = native

    @classmethod
    def read(
        cls,
        path: str | os.PathLike[str],
        *,
        also: list[str] | tuple[str, ...] = (),
        columns: Mapping[str, str] | None = None,
        units: Mapping[str, str] | None = None,
        sample_rate_Hz: float | None = None,
        notes: Mapping[str, str] | None = None,
    ) -> Log:
        """Reads a file: CSV, Parquet; with a mapping also text of other programs, MATLAB (.mat) and HDF5.

        ``also``: columns of own names to read. A file ``NAME.import.toml`` beside the log holds, as for ``stand``; what is stated here holds for this call.
        """
        return cls(
            _native.Log.read(
                _convert.path_of(path),
                list(also),
                _convert.stated(columns, units, sample_rate_Hz, notes),
            )
        )

    @classmethod
    def of(
        cls,
        data: Any,
        *,
        name: str = "frame",
        columns: Mapping[str, str] | None = None,
        units: Mapping[str, str] | None = None,
        sample_rate_Hz: float | None = None,
        notes: Mapping[str, str] | None = None,
    ) -> Log:
        """The log of a table in memory: a DataFrame of pandas, any object with ``__arrow_c_stream__`` (polars, pyarrow, DuckDB), or a mapping of names to arrays.

        Integers, float32 and booleans become float64; time stamps become seconds, from the first row where they are dates. A column of a name of the project
        must be complete; with ``columns``, ``units`` or ``sample_rate_Hz`` rows that lack a used value are left out, with a warning. ``name``: name in messages.
        """
        stated = _convert.stated(columns, units, sample_rate_Hz, notes)
        if isinstance(data, Log):
            return cls(_native.Log.of_columns(name, _convert.columns(data.to_dict().items()), data.notes, stated))
        if _convert.is_pandas(data):
            own = [(str(key), str(text)) for key, text in data.attrs.get("notes", [])]
            return cls(_native.Log.of_columns(name, _convert.pandas_columns(data), own, stated))
        if hasattr(data, "__arrow_c_stream__"):
            return cls(_native.Log.of_arrow(name, data.__arrow_c_stream__(), stated))
        if isinstance(data, Mapping):
            return cls(_native.Log.of_columns(name, _convert.columns(data.items()), [], stated))
        raise TypeError(f"a log cannot be made of {type(data).__name__}: give a DataFrame, an Arrow table or a mapping of names to arrays")

    @classmethod
    def from_pandas(cls, frame: pandas.DataFrame, **arguments: Any) -> Log:
        """The log of a DataFrame; an index that is not the number of the row is a column. Arguments as of :meth:`of`."""
        if not _convert.is_pandas(frame):
            raise TypeError(f"from_pandas needs a pandas.DataFrame, not {type(frame).__name__}")
        return cls.of(frame, **arguments)

    @classmethod
    def from_polars(cls, frame: polars.DataFrame, **arguments: Any) -> Log:
        """The log of a polars DataFrame. Arguments as of :meth:`of`."""
        return cls.from_arrow(frame, **arguments)

    @classmethod
    def from_arrow(cls, table: Any, **arguments: Any) -> Log:
        """The log of an object with ``__arrow_c_stream__``. Its schema metadata are the notes. Arguments as of :meth:`of`."""
        if not hasattr(table, "__arrow_c_stream__"):
            raise TypeError(f"{type(table).__name__} has no __arrow_c_stream__")
        return cls.of(table, **arguments)

    @classmethod
    def from_dict(cls, data: Mapping[str, npt.ArrayLike], **arguments: Any) -> Log:
        """The log of a mapping of names to arrays of shape (rows,). Arguments as of :meth:`of`."""
        if not isinstance(data, Mapping):
            raise TypeError(f"from_dict needs a mapping of names to arrays, not {type(data).__name__}")
        return cls.of(data, **arguments)

    @classmethod
    def from_mat(cls, path: str | os.PathLike[str], *, variables: list[str] | None = None, **arguments: Any) -> Log:
        """The log of the vectors of a MATLAB file (version 4 to 7.2, read by SciPy). ``variables``: those to read; default: all vectors of one length.

        Arguments as of :meth:`of`. Files of version 7.3, structures and timetables: :meth:`read`.
        """
        loadmat = needed("scipy.io", "scipy").loadmat
        try:
            found = loadmat(_convert.path_of(path), variable_names=variables)
        except NotImplementedError as error:
            raise NotImplementedError(f"{path}: a MATLAB file of version 7.3; read it with Log.read") from error
        vectors = {name: np.ravel(v) for name, v in found.items() if not name.startswith("__") and np.ndim(v) == 2 and 1 in np.shape(v)}
        if variables is None and vectors:
            rows = max(v.size for v in vectors.values())
            vectors = {name: v for name, v in vectors.items() if v.size == rows}
        return cls.of(vectors, **{"name": str(path), **arguments})

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the log with its notes: CSV or Parquet, by the ending of the name. An existing file is replaced."""
        self._native.write(_convert.path_of(path))

    def to_mat(self, path: str | os.PathLike[str]) -> None:
        """Writes the columns as vectors of a MATLAB file of version 5 (by SciPy); the notes are not written."""
        needed("scipy.io", "scipy").savemat(_convert.path_of(path), self.to_dict(), oned_as="column")

    def to_dict(self) -> dict[str, npt.NDArray[np.float64]]:
        """The columns by name, read-only arrays of shape (rows,) that share the memory of the log."""
        return {name: self[name] for name in self.columns}

    def to_pandas(self) -> pandas.DataFrame:
        """The log as a DataFrame; its ``attrs["notes"]`` are the notes."""
        frame: pandas.DataFrame = needed("pandas").DataFrame(self.to_dict())
        frame.attrs["notes"] = self.notes
        return frame

    to_frame = to_pandas

    def to_polars(self) -> polars.DataFrame:
        """The log as a polars DataFrame that shares its memory."""
        frame: polars.DataFrame = needed("polars").DataFrame(self)
        return frame

    def to_arrow(self) -> pyarrow.Table:
        """The log as a pyarrow Table that shares its memory; the notes are its schema metadata."""
        table: pyarrow.Table = needed("pyarrow").table(self)
        return table

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        """The log as an Arrow stream of one batch of float64 columns that share its memory (PyCapsule interface)."""
        return self._native.arrow_stream()

    @property
    def path(self) -> str:
        """The file, or the name that was given."""
        return self._native.path

    @property
    def columns(self) -> list[str]:
        """Names of the columns, in their order."""
        return self._native.columns

    @property
    def ignored(self) -> list[str]:
        """Names of columns that were not read."""
        return self._native.ignored

    @property
    def notes(self) -> list[tuple[str, str]]:
        """Notes in their order: key and text. A key may occur more than once."""
        return self._native.notes

    @property
    def warnings(self) -> list[str]:
        """Warnings about the log, one sentence each."""
        return self._native.warnings

    @property
    def interval_s(self) -> float:
        """Median interval of the rows, s."""
        return self._native.interval_s

    @property
    def duration_s(self) -> float:
        """Time from the first to the last row plus one interval, s."""
        return self._native.duration_s

    @property
    def segments(self) -> list[slice]:
        """Rows without a gap, in order; together all rows."""
        return [slice(first, end) for first, end in self._native.segments]

    def __getitem__(self, name: str) -> npt.NDArray[np.float64]:
        """The column of this name: a read-only array of shape (rows,) that shares the memory of the log. KeyError if there is none."""
        values = self._native.column(name)
        if values is None:
            raise KeyError(f"{name}: no column of {self.path}, which has {', '.join(self.columns)}")
        return values

    def __contains__(self, name: object) -> bool:
        return name in self.columns

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def __len__(self) -> int:
        """Number of rows."""
        return len(self._native)

    def __repr__(self) -> str:
        return f"<Log {self.path}: {len(self)} rows, {self.duration_s:.6g} s, columns {', '.join(self.columns)}>"

    def _repr_html_(self) -> str:
        head = "".join(f"<th>{html.escape(name)}</th>" for name in self.columns)
        row = "".join
        rows = row(
            "<tr>" + row(f"<td>{self[name][k]:.6g}</td>" for name in self.columns) + "</tr>" for k in range(min(_SHOWN_ROWS, len(self)))
        )
        warnings = "".join(f"<p>{html.escape(warning)}</p>" for warning in self.warnings)
        caption = f"{html.escape(self.path)}: {len(self)} rows, {self.duration_s:.6g} s"
        return f"<p>{caption}</p>{warnings}<table><tr>{head}</tr>{rows}</table>"

    def plot(self, *columns: str, figure: Any = None) -> Any:
        """Plots columns over time, one below the other; default: those of the drive. Returns the matplotlib Figure. KeyError for an unknown column."""
        usual = [name for name in ("u_V", "i_A", "omega_rad_s", "theta_rad", "v_m_s", "x_m", "torque_N_m", "force_N") if name in self]
        shown = list(columns) or usual or [name for name in self.columns if name != "t_s"]
        figure = figure or needed("matplotlib.pyplot", "matplotlib").figure(figsize=(8, 1.6 * len(shown) + 0.6), layout="constrained")
        axes = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
        for axis, name in zip(axes, shown):
            axis.plot(self["t_s"], self[name], linewidth=0.8)
            axis.set_ylabel(name)
        axes[-1].set_xlabel("t_s")
        return figure


def inspect(
    source: Any,
    *,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    sample_rate_Hz: float | None = None,
    notes: Mapping[str, str] | None = None,
) -> Inspection:
    """What a file or table contains: rows, rate, gaps; for each column its range, resolution, unit, and what it is believed to be. As ``stand log inspect``.

    ``source``: a path, a DataFrame of pandas or polars, or a mapping of names to arrays. Raises LogError where a statement does not fit the data.
    """
    stated = _convert.stated(columns, units, sample_rate_Hz, notes)
    if isinstance(source, (str, os.PathLike)):
        return Inspection(_native.inspect_file(_convert.path_of(source), stated))
    if _convert.is_pandas(source):
        return Inspection(_native.inspect_columns(_convert.pandas_columns(source), stated))
    items = source.items() if isinstance(source, Mapping) else ((name, source[name].to_numpy()) for name in source.columns)
    return Inspection(_native.inspect_columns(_convert.columns(items), stated))
