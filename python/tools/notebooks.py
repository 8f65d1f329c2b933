"""Executes every notebook; one that raises ends with its traceback."""

import sys
from pathlib import Path

import nbformat
from nbclient import NotebookClient

FOLDER = Path(__file__).resolve().parents[1] / "notebooks"


def main() -> None:
    notebooks = sorted(FOLDER.glob("*.ipynb"))
    if not notebooks:
        sys.exit("there are no notebooks")
    for path in notebooks:
        notebook = nbformat.read(path, as_version=4)
        if any(cell.get("outputs") for cell in notebook.cells):
            sys.exit(f"{path.name} has outputs: they are made where it is executed")
        NotebookClient(
            notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": str(FOLDER)}}
        ).execute()
        sys.stdout.write(f"{path.name}: {len(notebook.cells)} cells executed\n")


main()
