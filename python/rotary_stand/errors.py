"""Exceptions of the package. All derive from :class:`RotaryStandError`; those about an input derive from :class:`ValueError` too."""

from __future__ import annotations

import json
from typing import Any


class RotaryStandError(Exception):
    """An error of this package."""


class LogError(RotaryStandError, ValueError):
    """A log cannot be read, written or used.

    ``path``: file, or the name of a log in memory. ``row``: row of the table from 1, or None. ``column``: name of the column, or None.
    """

    def __init__(self, message: str, path: str = "", row: int | None = None, column: str | None = None) -> None:
        super().__init__(message)
        self.path = path
        self.row = row
        self.column = column


class ModelError(RotaryStandError, ValueError):
    """A model is invalid.

    ``path``: file, or the name of the model. ``line``, ``column``: position in its text from 1, or None. ``key``: the key, may be empty.
    """

    def __init__(self, message: str, path: str = "", line: int | None = None, column: int | None = None, key: str = "") -> None:
        super().__init__(message)
        self.path = path
        self.line = line
        self.column = column
        self.key = key


class AnalysisError(RotaryStandError, ValueError):
    """An analysis is not possible with this log, model or argument."""


class ImplausibleLogError(AnalysisError):
    """The log is not a plausible record of a drive (verdict ``bad-log``); nothing was computed.

    ``data``: the answer of ``--json``. ``html``: the page of ``--html``.
    """

    def __init__(self, message: str, data: str = "{}", html: str = "") -> None:
        super().__init__(message)
        self.data: dict[str, Any] = json.loads(data)
        self.html = html


class StandError(RotaryStandError):
    """The stand, its line or a session on it failed."""
