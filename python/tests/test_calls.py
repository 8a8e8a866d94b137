"""How calls behave: progress, Ctrl-C, threads."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path

import pytest

import rotary_stand as rs

SLOW = """
    import sys, time
    import rotary_stand as rs
    model = rs.Model.read(sys.argv[2])
    log = rs.Log.read(sys.argv[1])
    print("ready", flush=True)
    try:
        {call}
        print("finished", flush=True)
    except KeyboardInterrupt:
        print("interrupted", flush=True)
"""


@pytest.fixture(scope="module")
def long_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("long") / "long.parquet"
    rs.simulated_log(path, seconds=120, seed=2, hidden="stribeck")
    return path


@pytest.mark.parametrize(
    "call",
    [
        "rs.explain(log, model, time_limit_s=None)",
        "rs.explain(log, model, progress=True)",
        "[rs.fit(log, model.copy().add('compliance', 'cogging', 'load')) for _ in range(100)]",
        "rs.simulated_log(sys.argv[1] + '.out.parquet', seconds=3600)",
        "rs.Stand.simulated(1).wait(60)",
        "rs.Stand.simulated(1).record(seconds=60)",
        "rs.calibrate_simulated(sys.argv[1] + '.session', kind='drive')",
    ],
)
def test_ctrl_c_ends_a_call_within_two_seconds(call: str, long_log: Path, nominal: rs.Model, folder: Path) -> None:
    model = folder / "nominal.toml"
    nominal.write(model)
    script = textwrap.dedent(SLOW).format(call=call)
    with subprocess.Popen([sys.executable, "-c", script, long_log, model], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        time.sleep(0.7)
        process.send_signal(signal.SIGINT)
        sent = time.monotonic()
        assert process.stdout.readline() == "interrupted\n"
        assert time.monotonic() - sent < 2.0
        process.wait(timeout=10)
        assert time.monotonic() - sent < 6.0


def test_other_threads_run_during_a_call(cogging_log: rs.Log, nominal: rs.Model) -> None:
    ticks: list[float] = []
    ends = threading.Event()

    def tick() -> None:
        while not ends.wait(0.01):
            ticks.append(time.monotonic())

    thread = threading.Thread(target=tick)
    thread.start()
    begin = time.monotonic()
    rs.explain(cogging_log, nominal)
    seconds = time.monotonic() - begin
    ends.set()
    thread.join()
    assert len(ticks) > 20 * seconds


def test_calls_run_side_by_side(cogging_log: rs.Log, null_log: rs.Log, nominal: rs.Model) -> None:
    answers: dict[str, rs.Explanation] = {}
    logs = {"cogging": cogging_log, "null": null_log}
    threads = [threading.Thread(target=lambda name=name: answers.update({name: rs.explain(logs[name], nominal)})) for name in logs]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert (answers["cogging"].missing, answers["null"].missing) == (["cogging"], [])


def test_progress_tells_the_stages_and_its_error_ends_the_call(cogging_log: rs.Log, nominal: rs.Model) -> None:
    stages: list[str] = []
    rs.explain(cogging_log, nominal, progress=lambda stage, fraction: stages.append(stage))
    assert stages[0] == "fitting the given model" and len(stages) >= 3

    def fails(stage: str, fraction: float | None) -> None:
        raise LookupError("of the caller")

    begin = time.monotonic()
    with pytest.raises(LookupError, match="of the caller"):
        rs.explain(cogging_log, nominal, progress=fails)
    assert time.monotonic() - begin < 2.0
    # The cancelled call leaves nothing behind that ends the next one.
    assert rs.explain(cogging_log, nominal).missing == ["cogging"]


def test_progress_has_fractions(tmp_path: Path) -> None:
    fractions: list[float | None] = []
    rs.simulated_log(tmp_path / "a.parquet", seconds=5, progress=lambda stage, fraction: fractions.append(fraction))
    assert fractions == sorted(fractions, key=lambda f: f or 0.0) and len(fractions) > 10


def test_search_that_is_out_of_time_says_so(cogging_log: rs.Log, nominal: rs.Model) -> None:
    assert rs.explain(cogging_log, nominal, time_limit_s=0.01).verdict == "not-finished"


def test_wheel_runs_on_every_x86_64() -> None:
    from rotary_stand import _native

    if "ROTARY_STAND_WHEEL" not in os.environ:
        pytest.skip("ROTARY_STAND_WHEEL is not set: this is not the wheel")
    assert _native.instruction_sets() == []
