"""Many logs: one process and a cluster give the same table, which DuckDB and polars read; a worker that is killed costs nothing."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rotary_stand as rs
from rotary_stand import fleet

duckdb = pytest.importorskip("duckdb")
pl = pytest.importorskip("polars")
distributed = pytest.importorskip("distributed")

LOGS = 200
ROWS = 300
INTERVAL_S = 0.01
VISCOUS_N_M_S = 1e-3


def written_logs(folder: Path) -> Path:
    """Logs of a drive with inertia and viscous friction under a random torque that is constant in each row; in every tenth a constant load, which the model lacks.

    One file is corrupt. The equation of the drive is solved exactly.
    """
    rng = np.random.default_rng(1)
    inertia = 2.5e-4 * (1 + 0.02 * rng.standard_normal(LOGS))
    load = np.where(np.arange(LOGS) % 10 == 3, 4e-3, 0.0)
    t_s = INTERVAL_S * np.arange(ROWS)
    torque = np.repeat(rng.choice([-0.02, -0.012, 0.013, 0.021], size=(ROWS // 20, LOGS)), 20, axis=0)
    decay = np.exp(-INTERVAL_S * VISCOUS_N_M_S / inertia)
    omega = np.zeros((ROWS, LOGS))
    for row in range(1, ROWS):
        omega[row] = decay * omega[row - 1] + (1 - decay) * (torque[row - 1] - load) / VISCOUS_N_M_S
    measured = omega + 0.1 * rng.standard_normal(omega.shape)
    for k in range(LOGS):
        notes = {"stand": f"RS-{k % 20}", "batch": "A" if k % 20 < 10 else "B", "date": f"2026-{9 + k // 20 % 2:02}-{1 + k // 20:02}", "omega_rad_s": "at t"}
        log = rs.Log.from_dict({"t_s": t_s, "torque_N_m": torque[:, k], "omega_rad_s": measured[:, k]}, notes=notes)
        log.write(folder / f"{k:03}.parquet")
    (folder / "corrupt.parquet").write_bytes(b"PAR1 and no more")
    return folder


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written_logs(tmp_path_factory.mktemp("fleet"))


@pytest.fixture(scope="module")
def model() -> rs.Model:
    parameters = {"inertia_kg_m2": 2.2e-4, "viscous_N_m_s": 8e-4}
    return rs.Model(["viscous"], input="torque_N_m", parameters=parameters, name="drive")


@pytest.fixture(scope="module")
def table(logs: Path, model: rs.Model, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The table of one process."""
    out = tmp_path_factory.mktemp("one process") / "answers.parquet"
    answer = fleet.explain(logs, model, out=out, threads=2)
    assert (answer.logs, answer.computed, answer.failed) == (LOGS + 1, LOGS + 1, 1)
    return out


def rows(path: Path) -> Any:
    """The table without the computing times."""
    return pl.read_parquet(path).drop("seconds")


def journal(path: Path) -> list[dict[str, Any]]:
    return [entry["row"] for entry in map(json.loads, Path(f"{path}.journal").read_text().splitlines()) if "row" in entry]


def test_cluster_that_loses_a_worker_gives_the_table_of_one_process(table: Path, logs: Path, model: rs.Model, tmp_path: Path) -> None:
    out = tmp_path / "answers.parquet"
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster, distributed.Client(cluster) as client:
        workers = client.run(os.getpid)
        assert len(workers) == 2
        killed: list[int] = []

        def kill_midway(_: str, fraction: float | None) -> None:
            if not killed and fraction is not None and fraction > 0.4:
                killed.append(next(iter(workers.values())))
                os.kill(killed[0], signal.SIGKILL)

        answer = fleet.explain(logs, model, out=out, client=client, progress=kill_midway)
        assert killed and answer.failed == 1 and answer.logs == LOGS + 1
        assert rows(out).equals(rows(table))
        assert len(journal(out)) == LOGS + 1
        again = fleet.explain(logs, model, out=out, client=client)
        assert again.computed == 0 and rows(out).equals(rows(table))


def test_interrupted_call_keeps_its_answers(logs: Path, model: rs.Model, tmp_path: Path) -> None:
    out = tmp_path / "answers.parquet"
    some = sorted(logs.iterdir())[:6]

    def stop(_: str, fraction: float | None) -> None:
        if fraction is not None and fraction >= 0.5:
            raise KeyboardInterrupt

    with distributed.Client(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None) as client:
        with pytest.raises(KeyboardInterrupt):
            fleet.explain(some, model, out=out, client=client, progress=stop)
        kept = len(rows(out))
        assert 3 <= kept < 6
        assert fleet.explain(some, model, out=out, client=client).computed == 6 - kept
    assert len(rows(out)) == 6


def test_duckdb_and_polars_query_the_table(table: Path) -> None:
    counts = dict(duckdb.sql(f"SELECT verdict, count(*) FROM '{table}' GROUP BY verdict").fetchall())
    assert counts["error"] == 1 and counts["adequate"] >= 0.95 * 0.9 * LOGS
    loaded = duckdb.sql(
        f"SELECT count(*) FROM '{table}' WHERE list_contains(effects, 'load') OR len(list_filter(not_distinguishable, lambda x: x.alternative = 'load')) > 0"
    ).fetchall()
    frame = pl.read_parquet(table)
    named = pl.col("effects").list.contains("load")
    alternative = pl.col("not_distinguishable").list.eval(pl.element().struct.field("alternative") == "load").list.any()
    assert loaded == [(len(frame.filter(named | alternative)),)] and loaded[0][0] >= 0.9 * 0.1 * LOGS
    inertia = duckdb.sql(
        f"SELECT stand, avg(p.value), count(*) FROM (SELECT stand, unnest(parameters) AS p FROM '{table}') WHERE p.name = 'inertia_kg_m2' GROUP BY stand ORDER BY stand"
    ).fetchall()
    assert len(inertia) == 20 and all(value == pytest.approx(2.5e-4, rel=0.05) for _, value, _ in inertia)
    exploded = frame.explode("parameters").unnest("parameters").filter(pl.col("name") == "inertia_kg_m2")
    by_stand = exploded.group_by("stand").agg(pl.col("value").mean()).sort("stand")
    assert by_stand["value"].to_list() == pytest.approx([value for _, value, _ in inertia])
    assert frame["began"].dtype == pl.Datetime("us", "UTC") and frame["path"].is_sorted()


def test_report_reads_the_table(table: Path, tmp_path: Path) -> None:
    answer = fleet.report(table, since="2026-10-01")
    assert answer.data["stands"] == 20 and answer.data["batches"] == 2 and len(answer.data["failed"]) >= 1
    assert answer.parameter_changes == [] or set(answer.parameter_changes[0]) >= {"stand", "z", "adjusted_p"}
    answer.save_html(tmp_path / "fleet.html")
    assert "</html>" in (tmp_path / "fleet.html").read_text()
    with pytest.raises(ValueError, match="since"):
        fleet.report(table, since="lately")


def test_stands_are_stated_by_a_table(logs: Path, model: rs.Model, tmp_path: Path) -> None:
    first = logs / "000.parquet"
    (tmp_path / "stands.csv").write_text(f"path,stand,date,batch\n{first},left,2026-11-02,7\n")
    out = tmp_path / "answers.parquet"
    fleet.explain([first], model, out=out, stands=tmp_path / "stands.csv")
    assert rows(out).select("stand", "batch").row(0) == ("left", "7")
    with pytest.raises(rs.AnalysisError, match="line 2"):
        (tmp_path / "stands.csv").write_text("path,stand\na,b,c\n")
        fleet.explain([first], model, out=out, stands=tmp_path / "stands.csv")
