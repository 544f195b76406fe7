"""Run a notebook from top to bottom and write it with what its cells show: python docs/run_notebook.py IN OUT.

Its cells run in the folder of IN, by the interpreter that runs this file. An error of a cell ends the run.
"""

import sys
from pathlib import Path

import nbformat
from jupyter_client.kernelspec import KernelSpecManager
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient

SECONDS = 300  # for a cell, on a busy machine


def main(source, target):
    """Run the notebook `source`; write `target`."""
    notebook = nbformat.read(source, as_version=4)
    # without folders of kernels, python3 is the interpreter that runs this
    kernel = AsyncKernelManager(kernel_name="python3", kernel_spec_manager=KernelSpecManager(kernel_dirs=[]))
    place = {"metadata": {"path": str(Path(source).resolve().parent)}}
    NotebookClient(notebook, km=kernel, resources=place, timeout=SECONDS).execute()
    nbformat.write(notebook, target)


if __name__ == "__main__":
    main(*sys.argv[1:])
