"""Many logs: their answers as one Parquet table, on this machine or on the workers of a Dask cluster, and what the table says about the stands.

>>> from rotary_stand import fleet
>>> fleet.explain("logs/", "drive.toml", out="answers.parquet")                  # all cores of this machine
>>> fleet.explain("logs/", "drive.toml", out="answers.parquet", client=client)   # a distributed.Client
>>> fleet.report("answers.parquet").save_html("fleet.html")

The table is that of ``stand explain FOLDER --table``, row by row; docs/fleets.md describes it.
"""

from __future__ import annotations

import os
from collections.abc import Generator, Iterable, Sequence
from contextlib import closing
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Union

from . import _convert, _native
from ._progress import Progress, reporting
from .analyses import EFFORT_PASSES, ModelLike, _effort, _limit, _model
from .answers import FleetReport, FleetTable

if TYPE_CHECKING:
    from distributed import Client

__all__ = ["explain", "report"]

PathLike = Union[str, "os.PathLike[str]"]

#: Logs that one task hashes: a task of the scheduler costs about a millisecond, a log of 1 MB as much.
HASHED_AT_ONCE = 50
#: Tasks that are submitted at the same time for each thread of the cluster. Few, so that the scheduler's memory does not grow with the number of logs; enough that
#: no worker waits.
TASKS_PER_THREAD = 8
#: Times that the cluster computes a log again after an exception of its task.
RETRIES = 2

_Hashed = tuple[str, Union[str, None], Union[int, None], Union[str, None]]


def explain(
    paths: PathLike | Iterable[PathLike],
    model: ModelLike,
    *,
    out: PathLike,
    client: Client | None = None,
    stands: PathLike | None = None,
    effort: int | None = EFFORT_PASSES,
    time_limit_s: float | None = None,
    threads: int | None = None,
    progress: Progress = False,
) -> FleetTable:
    """Explains each log separately and writes the answers as a Parquet table to ``out``, one row a log, sorted by path.

    ``paths``: logs, or folders with logs (with their subfolders). ``client``: a ``distributed.Client``; its workers need this package and must see the logs under these
    paths. Without it, ``threads`` threads of this process (default: one for each processor). ``stands``: a CSV with the columns ``path,stand,date,batch``, where the logs do
    not state them. Answers are kept in ``out`` + ``.journal`` as they arrive: an interrupted call continues where it was, and a log is computed once whatever it is
    called. A log that cannot be read or computed becomes a row with the verdict ``error``; it stops nothing.

    Raises ModelError, ValueError, AnalysisError (``stands``), OSError (a folder or the table).
    """
    model = _model(model)
    names = [_convert.path_of(paths)] if isinstance(paths, (str, os.PathLike)) else [_convert.path_of(path) for path in paths]
    table = _convert.path_of(out)
    logs = [path for path in _native.fleet_logs(names) if os.path.abspath(path) != os.path.abspath(table)]
    effort, limit = _effort(effort), _limit(time_limit_s)
    session = _native.FleetSession(table, model._native, effort, limit, None if stands is None else _convert.path_of(stands))
    try:
        with reporting(progress) as told:
            if client is None:
                return FleetTable(session.run(logs, threads or os.cpu_count() or 1, told))
            task = _Task(model.to_toml(), effort, limit)
            return FleetTable(_on_cluster(session, logs, task, client, told))
    finally:
        session.close()


def report(tables: PathLike | Sequence[PathLike], *, since: str | None = None, stands: PathLike | None = None) -> FleetReport:
    """Compares the stands of tables: changes since a date, effects common to a batch, outliers (``stand fleet report``).

    ``tables``: files or folders of files. ``since``: a date, ``2026-11-22`` or with a time; default one month before the last log. ``stands``: as of :func:`explain`.
    Raises AnalysisError, ValueError.
    """
    names = [_convert.path_of(tables)] if isinstance(tables, (str, os.PathLike)) else [_convert.path_of(table) for table in tables]
    return FleetReport(_native.fleet_report(names, since, None if stands is None else _convert.path_of(stands)))


class _Task:
    """What a worker is asked about a log; small, since it travels with each task."""

    def __init__(self, model: str, effort: int | None, time_limit_s: float | None) -> None:
        self.model = model
        self.effort = effort
        self.time_limit_s = time_limit_s

    def __call__(self, log: tuple[str, str, int]) -> str:
        path, sha256, size = log
        return _native.fleet_row(path, sha256, size, _parsed(self.model), self.effort, self.time_limit_s)


@lru_cache(maxsize=4)
def _parsed(model: str) -> _native.Model:
    return _native.Model.parse(model, "model")


def _hashes(paths: list[str]) -> list[_Hashed]:
    return [(path, *_native.fleet_hash(path)) for path in paths]


def _on_cluster(session: _native.FleetSession, logs: list[str], task: _Task, client: Client, told: Any) -> _native.Answer:
    """The answers by the workers of a cluster. A lost worker's tasks are computed by another one: that is the scheduler's work."""
    chunks = [logs[k : k + HASHED_AT_ONCE] for k in range(0, len(logs), HASHED_AT_ONCE)]
    hashed: list[_Hashed] = []
    with closing(_completed(client, _hashes, chunks)) as completed:
        for chunk, result in completed:
            # Without a hash from a worker there is no answer; the reason becomes the row's.
            hashed.extend([(path, None, None, f"{path}: {result}") for path in chunk] if isinstance(result, BaseException) else result)
    open_logs = session.open_logs(hashed)
    done, computed = len(logs) - len(open_logs), 0
    try:
        with closing(_completed(client, task, open_logs)) as completed:
            for log, result in completed:
                if isinstance(result, BaseException):
                    session.fail(log[1], f"the cluster gave no answer: {type(result).__name__}: {result}")
                else:
                    session.record(result)
                    computed += 1
                done += 1
                if told is not None:
                    told(log[0], done / len(logs))
    finally:
        # After an interruption too: the table then has the answers so far.
        summary = session.finish(hashed, computed)
    return summary


def _completed(client: Client, function: Any, items: Sequence[Any]) -> Generator[tuple[Any, Any], None, None]:
    """Each item with the result of the function or its exception, as they are completed; only some tasks are submitted at the same time."""
    from distributed import as_completed

    remaining = iter(items)
    submitted: dict[str, Any] = {}

    def submit(count: int) -> list[Any]:
        futures = []
        for _, item in zip(range(count), remaining):
            future = client.submit(function, item, pure=False, retries=RETRIES)
            submitted[future.key] = item
            futures.append(future)
        return futures

    threads = sum(client.nthreads().values()) or 1
    running = as_completed(submit(TASKS_PER_THREAD * threads), with_results=True, raise_errors=False)
    try:
        for future, result in running:
            item = submitted.pop(future.key)
            if isinstance(result, tuple) and len(result) == 3 and isinstance(result[1], BaseException):
                result = result[1]  # the exception with its type and traceback
            yield item, result
            for more in submit(1):
                running.add(more)
    finally:
        client.cancel([future for future in running.futures], force=True)
