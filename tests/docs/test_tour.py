"""The notebook runs from its first cell to its last, and shows what it says."""

import os
import sys
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

NOTEBOOK = Path(__file__).parents[2] / "docs/tour.ipynb"


def test_the_notebook_is_stored_without_outputs():
    """So that it differs only where somebody changed it."""
    cells = [cell for cell in nbformat.read(NOTEBOOK, as_version=4).cells if cell.cell_type == "code"]
    assert [cell for cell in cells if cell.outputs or cell.execution_count] == []


@pytest.mark.slow
def test_the_notebook_leads_from_a_source_to_a_batch(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    NotebookClient(notebook, timeout=500, kernel_name="python3").execute(cwd=str(tmp_path))
    shown = "\n".join(
        str(output.get("text") or output.get("data")) for cell in notebook.cells for output in cell.get("outputs", [])
    )
    assert shown.count("'image/png': ") == 2  # figures; a release shows its pictures as HTML
    assert "<figure" in shown  # a release as a contact sheet
    assert "percentile" in shown
    assert "'goal_camera0_m': (2, 3)" in shown
    assert "torch.Size([2, 5, 7])" in shown
