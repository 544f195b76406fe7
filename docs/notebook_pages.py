"""Run the notebooks of docs/notebooks and write what they show as pages: docs/notebook-NAME.md; see `make docs`.

With names of notebooks and a folder the pages go there: python docs/notebook_pages.py --to DIR one-cable.
"""

import re
import sys
from base64 import b64decode
from pathlib import Path

import nbformat
from jupyter_client.kernelspec import KernelSpecManager
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient

DOCS = Path(__file__).resolve().parent
SECONDS = 300  # for a cell, on a busy machine
ROW, CELL = re.compile(r"<tr.*?</tr>", re.DOTALL), re.compile(r"<t[hd][^>]*>(.*?)</t[hd]>", re.DOTALL)


def run(path):
    """A notebook after all its cells have run, in its folder, by the interpreter that runs this file."""
    notebook = nbformat.read(path, as_version=4)
    # without folders of kernels, python3 is this interpreter
    kernel = AsyncKernelManager(kernel_name="python3", kernel_spec_manager=KernelSpecManager(kernel_dirs=[]))
    place = {"metadata": {"path": str(path.parent)}}
    NotebookClient(notebook, km=kernel, resources=place, timeout=SECONDS).execute()
    return notebook


def write_page(path, folder):
    """Run a notebook and write its page and pictures to a folder."""
    parts, name = [], path.stem
    (folder / "pictures").mkdir(parents=True, exist_ok=True)
    for number, cell in enumerate(run(path).cells):
        parts.append(cell.source if cell.cell_type == "markdown" else fenced(cell.source, "python"))
        if number == 0:
            parts.append(f"To run it: [notebooks/{path.name}](notebooks/{path.name}).")
        outputs = cell.get("outputs", ())
        said = "".join(output["text"] for output in outputs if output["output_type"] == "stream")
        parts += [fenced(said, "text")] if said else []
        for data in (output["data"] for output in outputs if output["output_type"] != "stream"):
            if "image/png" in data:
                picture = f"pictures/notebook-{name}-{number}.png"
                (folder / picture).write_bytes(b64decode(data["image/png"]))
                parts.append(f"![What the cell above draws]({picture})")
            elif "text/html" in data:
                parts.append(table(data["text/html"]))
            else:
                parts.append(fenced(data["text/plain"], "text"))
    (folder / f"notebook-{name}.md").write_text("\n\n".join(parts) + "\n", encoding="utf-8")


def fenced(text, kind):
    """Text as a block."""
    return f"```{kind}\n{text.strip()}\n```"


def table(html):
    """A data frame as Markdown."""
    head, *rows = ([cell.replace("|", "\\|") for cell in CELL.findall(row)] for row in ROW.findall(html))
    lines = [head, ["---:"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def main(words):
    """Write the pages of all notebooks, or of those named."""
    folder = Path(words[1]) if words[:1] == ["--to"] else DOCS
    names = words[2:] if words[:1] == ["--to"] else words
    for path in sorted((DOCS / "notebooks").glob("*.ipynb")):
        if not names or path.stem in names:
            write_page(path, folder)


if __name__ == "__main__":
    main(sys.argv[1:])
