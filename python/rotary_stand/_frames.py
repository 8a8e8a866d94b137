"""Optional packages, imported where they are needed."""

from __future__ import annotations

import importlib
from typing import Any


def needed(module: str, package: str | None = None) -> Any:
    """The module; ImportError with the command that installs its package."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = package or module
        raise ImportError(f"this needs {package}: pip install {package}") from error
