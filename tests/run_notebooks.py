"""Run notebooks, each in a kernel of its own: ``run_notebooks.py OUT IN [IN ...]``.

Kernels are forks of this process, which has imported what nearly all notebooks need:
that takes longer than most of their cells.
"""

import importlib
import os
import signal
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import nbformat
from ipykernel.kernelapp import IPKernelApp
from jupyter_client.asynchronous import AsyncKernelClient
from jupyter_client.connect import write_connection_file
from nbclient import NotebookClient

from ikns.live.warm_up import warm_up

SHARED = "matplotlib.pyplot", "pandas", "scipy.stats", "sklearn.cluster", "IPython"


class Running:
    """What nbclient asks of a kernel's manager, of a kernel that runs already."""

    has_kernel = True

    def __init__(self, connection_file: str) -> None:
        self._connection_file = connection_file

    def client(self) -> AsyncKernelClient:
        client = AsyncKernelClient()
        client.load_connection_file(self._connection_file)
        return client


def forked(work: Callable[..., None], *arguments: object) -> int:
    """Return the process that does the work and ends."""
    if process := os.fork():
        return process
    try:
        work(*arguments)
    except Exception:
        sys.excepthook(*sys.exc_info())
        os._exit(1)
    os._exit(0)


def kernel(connection_file: str, folder: Path) -> None:
    os.chdir(folder)
    parent = f"--IPKernelApp.parent_handle={os.getppid()}"  # it ends with it
    IPKernelApp.launch_instance(["-f", connection_file, parent])


def run(source: Path, target: Path) -> None:
    """Run a notebook; an error in a cell raises, with the cell and its traceback."""
    notebook = nbformat.read(source, as_version=4)
    with tempfile.TemporaryDirectory() as folder:
        # It talks through files, not through ports.
        connection, _ = write_connection_file(
            f"{folder}/kernel.json", ip=f"{folder}/kernel", transport="ipc"
        )
        process = forked(kernel, connection, source.parent)
        try:
            NotebookClient(
                notebook, km=Running(connection), record_timing=False
            ).execute()
        finally:
            os.kill(process, signal.SIGKILL)
            os.waitpid(process, 0)
    notebook.metadata["language_info"] = {"name": "python"}
    nbformat.write(notebook, target)


def main(target: Path, *sources: Path) -> int:
    """Return how many notebooks failed."""
    for name in SHARED:
        importlib.import_module(name)
    warm_up()
    # A process each: that of a kernel must not hold another's connections.
    failed = 0
    for source in sources:
        _, status = os.waitpid(forked(run, source, target / source.name), 0)
        failed += status != 0
    return failed


if __name__ == "__main__":
    sys.exit(main(*(Path(name).absolute() for name in sys.argv[1:])))
