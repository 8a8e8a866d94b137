"""A stand at a serial port, or a simulated one: SCPI as in PyVISA, profiles, recordings."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping, Sequence
from types import TracebackType
from typing import Any

from . import _convert, _native
from ._progress import Progress, reporting
from .errors import StandError
from .log import Log


class Stand:
    """A stand. Use it in a ``with`` block: at its end, also after an exception, the drive is switched off and the port closed.

        with Stand("/dev/ttyACM0") as stand:
            stand.write("SOURce:RATE 1")
            stand.write("SOURce:MODE RATE")
            stand.wait(2)
            print(stand.query("MEASure:RATE?"))

    The stand switches its drive off 2 s after the last sign of life of the program; :meth:`wait` and :meth:`record` give them, ``time.sleep`` does not. Replies are
    plain numbers in SI units and radians. All methods raise :class:`~rotary_stand.StandError` where the line fails or the stand rejects a command.
    """

    __slots__ = ("_native",)

    def __init__(self, port: str | os.PathLike[str]) -> None:
        """Opens the serial port and identifies the stand. StandError: no such port, in use, or no stand behind it."""
        self._native = _native.Stand.open(_convert.path_of(port))

    @classmethod
    def simulated(cls, seed: int = 1, *, stand: str | None = None) -> Stand:
        """A simulated stand with its firmware, in real time behind a pseudo-terminal (Unix). ``stand``: the text of its description (TOML)."""
        made = cls.__new__(cls)
        made._native = _native.Stand.simulated(seed, stand)
        return made

    def __enter__(self) -> Stand:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Switches the drive off, also where the stand may run unattended, and closes the port. A second call does nothing."""
        self._native.close()

    @property
    def is_closed(self) -> bool:
        """The port is closed."""
        return self._native.is_closed

    @property
    def identity(self) -> str:
        """Reply to ``*IDN?``: manufacturer, model, serial number, firmware."""
        return self._native.identity

    @property
    def port(self) -> str:
        """The serial port."""
        return self._native.port

    def write(self, command: str) -> None:
        """Sends a command and checks that the stand accepted it."""
        self._native.write(command)

    def query(self, query: str) -> str:
        """Sends a query; the first line of the reply."""
        lines = self._native.query_lines(query)
        if not lines:
            raise StandError(f"{self.port}: no reply to `{query}`")
        return lines[0]

    def query_lines(self, query: str) -> list[str]:
        """Sends a query; all lines of the reply, for example of ``HELP?``."""
        return self._native.query_lines(query)

    def query_values(self, query: str) -> list[float]:
        """Sends a query; the numbers of the reply, separated by semicolons or commas. "Not a number" of SCPI (9.91E37) is nan, 9.9E37 is inf."""
        special = {9.91e37: float("nan"), 9.9e37: float("inf"), -9.9e37: float("-inf")}
        numbers = (float(word) for word in self.query(query).replace(";", ",").split(","))
        return [special.get(number, number) for number in numbers]

    def wait(self, seconds: float) -> None:
        """Waits with signs of life, s."""
        self._native.wait(seconds)

    def stop(self) -> None:
        """Stops the drive at once (byte 0x18). The stand latches this as a fault: the next call raises StandError with it; ``write("FAULt:CLEar")`` allows motion."""
        self._native.stop()

    def off(self) -> None:
        """Switches the drive off (``OUTPut OFF``)."""
        self.write("OUTPut OFF")

    def record(
        self,
        path: str | os.PathLike[str] | None = None,
        *,
        profile: str = "multi-step",
        mode: str = "rate",
        seconds: float = 30.0,
        seed: int = 1,
        decimation: int = 1,
        find_index: bool = False,
        also: Sequence[str] = (),
        notes: Mapping[str, str] | None = None,
        parameters: Mapping[str, float] | None = None,
        progress: Progress = False,
    ) -> Log:
        """Runs a profile and records it (``stand record``): the log, whose rows have 1 ms × ``decimation``.

        ``path``: file to write, .csv or .parquet; without one the log is in memory only. ``profile``, ``mode``, ``seed``, ``parameters`` as of
        :func:`rotary_stand.simulated_log`. ``find_index``: the platform turns to its index first. ``also``: further channels. ``notes``: notes for the log.
        Raises StandError where the recording ends early; its rows until then are in the file.
        """
        if path is None:
            with tempfile.TemporaryDirectory() as folder:
                return self.record(
                    os.path.join(folder, "recording.parquet"),
                    profile=profile,
                    mode=mode,
                    seconds=seconds,
                    seed=seed,
                    decimation=decimation,
                    find_index=find_index,
                    also=also,
                    notes=notes,
                    parameters=parameters,
                    progress=progress,
                )
        target = _convert.path_of(path)
        values: list[tuple[str, Any]] = list((parameters or {}).items())
        with reporting(progress) as report:
            ended = self._native.record(
                target, profile, mode, values, seconds, seed, decimation, find_index, list(also), _convert.pairs(notes, "notes"), report
            )
        if ended is not None:
            raise StandError(f"{self.port}: the recording ended early: {ended}; the rows until then are in {target}")
        return Log.read(target, also=list(also))

    def __repr__(self) -> str:
        return f"<Stand {self.port}: {'closed' if self.is_closed else self.identity}>"
