"""Progress of a call: none, a bar of tqdm, or a function of the caller."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Union

#: Called with the stage in words and the completed fraction, or None where it is unknown.
ProgressFunction = Callable[[str, "float | None"], Any]
Progress = Union[bool, ProgressFunction]


@contextmanager
def reporting(progress: Progress) -> Iterator[ProgressFunction | None]:
    """The function that the library calls."""
    if progress is False or progress is None:
        yield None
    elif progress is not True:
        if not callable(progress):
            raise TypeError("progress must be True, False or a function of stage and fraction")
        yield progress
    else:
        try:
            from tqdm.auto import tqdm
        except ImportError as error:
            raise ImportError("progress=True needs tqdm: pip install tqdm") from error
        with tqdm(total=1.0, bar_format="{desc} {bar} {elapsed}", leave=False) as bar:

            def show(stage: str, fraction: float | None) -> None:
                is_new = stage != bar.desc
                bar.set_description_str(stage, refresh=is_new)
                bar.update(0 if fraction is None else fraction - bar.n)

            yield show
