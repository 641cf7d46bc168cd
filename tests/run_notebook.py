"""Run a notebook in a process of its own: ``run_notebook.py IN OUT``."""

import sys
import tempfile
from pathlib import Path

import nbformat
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient


def main(source: Path, target: Path) -> None:
    notebook = nbformat.read(source, as_version=4)
    with tempfile.TemporaryDirectory() as folder:
        # A kernel of its own that talks through files, not through ports.
        manager = AsyncKernelManager(kernel_name="python3", transport="ipc")
        manager.connection_file = f"{folder}/kernel.json"
        manager.ip = f"{folder}/kernel"
        where = {"metadata": {"path": source.parent}}
        # An error in a cell raises, with the cell and its traceback.
        NotebookClient(
            notebook, km=manager, resources=where, record_timing=False
        ).execute()
    notebook.metadata["language_info"] = {"name": "python"}
    nbformat.write(notebook, target)


if __name__ == "__main__":
    main(Path(sys.argv[1]).absolute(), Path(sys.argv[2]))
