"""Makes the notebooks of docs/notebooks of their sources and executes them.

    python python/notebooks.py             # writes NAME.ipynb beside NAME.py, executed
    python python/notebooks.py --check     # executes them again in an empty folder; fails on an error, or where a notebook is not of its source

A source is Python with cells that begin with `# %%`, or `# %% [markdown]` for text in comments. Needs nbclient, nbformat and ipykernel.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path

import nbclient
import nbformat
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

FOLDER = Path(__file__).resolve().parent.parent / "docs" / "notebooks"
#: Largest size of a committed notebook, bytes: pictures, no pages.
MAX_SIZE = 600_000


def notebook_of(source: Path) -> nbformat.NotebookNode:
    """The notebook of a source, not executed."""
    cells = []
    for k, part in enumerate(source.read_text(encoding="utf-8").split("# %%")[1:]):
        head, _, body = part.partition("\n")
        body = body.strip("\n")
        if head.strip() == "[markdown]":
            cell = new_markdown_cell("\n".join(line.removeprefix("#").removeprefix(" ") for line in body.split("\n")))
        else:
            cell = new_code_cell(body)
        cell["id"] = f"cell-{k}"
        cells.append(cell)
    metadata = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}, "language_info": {"name": "python"}}
    return new_notebook(cells=cells, metadata=metadata)


def main() -> int:
    is_check = sys.argv[1:] == ["--check"]
    failed = 0
    for source in sorted(FOLDER.glob("*.py")):
        begin = time.monotonic()
        target, notebook = source.with_suffix(".ipynb"), notebook_of(source)
        if is_check:
            written = nbformat.read(target, as_version=4)
            if [(c.cell_type, c.source) for c in written.cells] != [(c.cell_type, c.source) for c in notebook.cells]:
                print(f"{target.name}: not of {source.name}; run python/notebooks.py")
                failed += 1
        with tempfile.TemporaryDirectory() as folder:
            # Each runs in an empty folder, so that the paths in its text are those of any user.
            nbclient.NotebookClient(notebook, timeout=300, kernel_name="python3", resources={"metadata": {"path": folder}}).execute()
        for cell in notebook.cells:
            cell.metadata.pop("execution", None)
        if not is_check:
            nbformat.write(notebook, target)
            if target.stat().st_size > MAX_SIZE:
                print(f"{target.name}: {target.stat().st_size} bytes, more than {MAX_SIZE}")
                failed += 1
        print(f"{target.name}: {time.monotonic() - begin:.1f} s, {os.path.getsize(target) // 1024} KB")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
