"""The stand: SCPI, recordings, and that it stops."""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path

import pytest

import rotary_stand as rs

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the simulated stand needs a pseudo-terminal")


@pytest.fixture
def stand() -> "rs.Stand":
    return rs.Stand.simulated(seed=2)


def turning(stand: rs.Stand) -> None:
    stand.write("SOURce:RATE 3")
    stand.write("SOURce:MODE RATE")
    stand.wait(1.0)
    assert stand.query_values("MEASure:RATE?")[0] == pytest.approx(3.0, abs=0.05)
    assert stand.query("OUTPut?") == "1"


def test_queries_and_commands(stand: rs.Stand) -> None:
    with stand:
        assert "Rotary Stand" in stand.query("*IDN?") and stand.identity.startswith("Rotary Stand")
        assert len(stand.query_values("MEASure:SUPPly?;TEMPerature?")) == 2
        assert math.isfinite(stand.query_values("MEASure:ANGLe?")[0])
        assert len(stand.query_lines("HELP?")) > 50
        with pytest.raises(rs.StandError, match="-113"):
            stand.write("SOUR:RAET 1")
        with pytest.raises(rs.StandError, match="-222"):
            stand.write("SOUR:RATE 99999")
        with pytest.raises(rs.StandError):
            stand.write("SOUR:RATE " + "1" * 500)
        with pytest.raises(TypeError):
            stand.write(3)  # type: ignore[arg-type]
        for seconds in (-1.0, math.nan, math.inf):
            with pytest.raises(ValueError):
                stand.wait(seconds)


def watched(seed: int) -> tuple[rs.Stand, rs.Stand]:
    """A simulated stand that goes on, and a connection to it."""
    served = rs.Stand.simulated(seed)
    port = served.port
    served._native.release_port()
    return served, rs.Stand(port)


@pytest.mark.parametrize("leaves", ["end", "exception", "interrupt", "close", "unattended"])
def test_platform_stops_when_the_block_ends(leaves: str) -> None:
    served, stand = watched(3)
    errors = {"exception": ZeroDivisionError, "interrupt": KeyboardInterrupt}
    try:
        with stand:
            turning(stand)
            if leaves == "unattended":
                stand.write("HOST:UNATTended 3600")
            if leaves == "close":
                stand.close()
            if leaves in errors:
                raise errors[leaves]
    except tuple(errors.values()):
        pass
    assert stand.is_closed
    with rs.Stand(served.port) as second:
        assert second.query("OUTPut?") == "0"
        second.wait(1.0)
        assert abs(second.query_values("MEASure:RATE?")[0]) < 0.05
    served.close()


def test_platform_stops_when_the_object_is_dropped() -> None:
    served, stand = watched(4)
    turning(stand)
    del stand
    with rs.Stand(served.port) as second:
        assert second.query("OUTPut?") == "0"
    served.close()


def test_wait_gives_signs_of_life_and_sleep_does_not(stand: rs.Stand) -> None:
    with stand:
        turning(stand)
        stand.wait(2.6)
        assert stand.query("OUTPut?") == "1"
        time.sleep(2.6)
        with pytest.raises(rs.StandError, match="host silent"):
            stand.query("OUTPut?")
        assert stand.query("OUTPut?") == "0"


def test_stop_byte_and_off(stand: rs.Stand) -> None:
    with stand:
        turning(stand)
        stand.off()
        assert stand.query("OUTPut?") == "0"
        turning(stand)
        stand.stop()
        stand.wait(0.2)
        with pytest.raises(rs.StandError, match="stop"):
            stand.query("OUTPut?")
        assert stand.query("OUTPut?") == "0"


def test_recording_is_a_log(stand: rs.Stand, tmp_path: Path) -> None:
    with stand:
        log = stand.record(tmp_path / "a.csv", seconds=2, seed=4, notes={"operator": "Ann"})
        assert len(log) == 2000 and ("operator", "Ann") in log.notes and log.path.endswith("a.csv")
        assert stand.query("OUTPut?") == "0"
        assert len(stand.record(seconds=1, decimation=10)) == 100
        for arguments in ({"seconds": -1.0}, {"profile": "zigzag"}, {"also": ["nothing"]}, {"decimation": 0}):
            with pytest.raises(ValueError):
                stand.record(**arguments)  # type: ignore[arg-type]
        with pytest.raises(rs.LogError):
            stand.record(tmp_path / "a.xlsx", seconds=1)


def test_closed_stand_says_so(stand: rs.Stand) -> None:
    stand.close()
    stand.close()
    assert stand.is_closed and "closed" in repr(stand)
    with pytest.raises(rs.StandError, match="closed"):
        stand.query("*IDN?")


def test_missing_port_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(rs.StandError, match="no such port"):
        rs.Stand(tmp_path / "port")
    with pytest.raises(TypeError):
        rs.Stand(3)  # type: ignore[arg-type]
