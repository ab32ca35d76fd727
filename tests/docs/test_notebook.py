"""The notebook of the loop runs from its first cell to its last, and ends where it says."""

import nbformat
import pytest
from nbclient import NotebookClient

from tests.conftest import ROOT


@pytest.mark.filterwarnings("ignore")  # of the kernel's own parts
def test_the_loop_runs():
    notebook = nbformat.read(ROOT / "docs" / "loop.ipynb", as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells)  # made by running it, not kept
    NotebookClient(notebook, timeout=600, kernel_name="python3").execute()
    said = ["".join(str(out.get("text", "")) + str(out.get("data", {})) for out in cell.get("outputs", ()))
            for cell in notebook.cells if cell.cell_type == "code"]  # fmt: skip
    assert any("Verdict on mount: axial_inertia" in text for text in said)
    assert "image/png" in said[-2] and "better.json" in said[-1]
