"""Executes every notebook and compares what its cells give with the outputs that it keeps: readers see these without executing anything.

Of a picture the title and the description are compared, which have its figures; colours and legends may change. `notebooks.py --update` keeps the outputs of
this execution instead. A cell that raises ends with its traceback.
"""

import re
import sys
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient

FOLDER = Path(__file__).resolve().parents[1] / "notebooks"


def compared(cell: Any) -> list[Any]:
    """What is compared of the outputs of a cell: text, in however many pieces it was flushed, and titles and descriptions of pictures."""
    outputs = cell.get("outputs", [])
    streams = [
        "".join(output.text for output in outputs if output.get("name") == name) for name in ("stdout", "stderr")
    ]
    shown = [output["data"] for output in outputs if "data" in output]
    pictures = [re.findall(r"<(?:title|desc)>(.*?)</", data.get("image/svg+xml", ""), re.DOTALL) for data in shown]
    return [streams, [data.get("text/plain") for data in shown], pictures]


def check(path: Path, update: bool) -> None:
    """Executes one notebook, and ends the program at the first cell that does not give what it keeps."""
    stored = nbformat.read(path, as_version=4)
    notebook = nbformat.read(path, as_version=4)
    NotebookClient(
        notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": str(FOLDER)}}
    ).execute()
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    for number, cell in enumerate(cells, 1):
        # What differs from one execution to the next: times, and where streams were flushed.
        cell.metadata.pop("execution", None)
        cell.execution_count = number
    notebook.metadata = stored.metadata
    # Text and lines of text are the same in a file; reading what would be written makes them comparable.
    notebook = nbformat.reads(nbformat.writes(notebook), as_version=4)
    if update:
        nbformat.write(notebook, path)
        return
    for before, after in zip(stored.cells, notebook.cells, strict=True):
        kept, given = compared(before), compared(after)
        if kept != given:
            told = f"kept:\n{kept}\ngiven:\n{given}\n`notebooks.py --update` keeps what is given."
            sys.exit(f"{path.name}: a cell does not give what it keeps:\n{before.source}\n{told}")


def main() -> None:
    notebooks = sorted(FOLDER.glob("*.ipynb"))
    if not notebooks:
        sys.exit("there are no notebooks")
    for path in notebooks:
        check(path, "--update" in sys.argv[1:])
        sys.stdout.write(f"{path.name}: executed\n")


main()
