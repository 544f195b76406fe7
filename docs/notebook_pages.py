"""Notebooks of docs/notebooks as pages of the site: executed, with what their cells print and draw."""

import base64
import re

import nbformat
from nbclient import NotebookClient

SECONDS = 600  # that a cell may take


def page(path, folder):
    """A notebook as Markdown, its pictures written to a folder.

    Parameters
    ----------
    path : Path
        Of the notebook; it is executed in its own folder.
    folder : Path
        Where its page will be, too.

    Returns
    -------
    str

    Raises
    ------
    nbclient.exceptions.CellExecutionError
        A cell fails.
    """
    notebook = nbformat.read(path, as_version=4)
    resources = {"metadata": {"path": str(path.parent)}}
    NotebookClient(notebook, timeout=SECONDS, kernel_name="python3", resources=resources).execute()
    parts, pictures = [], 0
    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            parts.append(cell.source)
            continue
        parts.append(f"```python\n{cell.source}\n```")
        for output in joined(cell.outputs):
            data = output.get("data", {})
            if "image/png" in data:
                pictures += 1
                name = f"{path.stem}-{pictures}.png"
                (folder / name).write_bytes(base64.b64decode(data["image/png"]))
                parts.append(f"![Picture {pictures} of the notebook]({name})")
            elif "text/html" in data:
                parts.append(f"```{{raw}} html\n{plain_table(data['text/html'])}\n```")
            else:
                parts.append(f"```text\n{output.get('text', data.get('text/plain', '')).rstrip()}\n```")
    return "\n\n".join(parts) + "\n"


def joined(outputs):
    """Outputs of a cell, of printed text that came in pieces one."""
    found = []
    for output in outputs:
        if found and output.output_type == found[-1].output_type == "stream":
            found[-1].text += output.text
        else:
            found.append(output)
    return found


def plain_table(html):
    """The HTML of a data frame in the style of the site's tables."""
    html = re.sub(r"<style.*?</style>", "", html, flags=re.DOTALL).strip()
    html = html.replace("<div>", '<div class="pst-scrollable-table-container">', 1)
    return html.replace('border="1" class="dataframe"', 'class="table"')
