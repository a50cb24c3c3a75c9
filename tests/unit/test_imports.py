"""What is imported where it is not needed costs every job and every run of snakemake seconds."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from neumat.metrics import inception
from neumat.reporting import tables

WORKFLOW = Path(__file__).parents[2] / "workflow"
GATHERING = ["table", "coverage_table", "run_table", "categories", "category_figures", "chart_models"]


def imports(text):
    """Return the import statements at the top level of a script or a rule file."""
    lines = text.split("\n\ntry:")[0]  # of common.smk, which is no Python below
    return "\n".join(
        ast.unparse(node) for node in ast.parse(lines).body if isinstance(node, ast.Import | ast.ImportFrom)
    )


@pytest.mark.parametrize("files", [[f"scripts/{name}.py" for name in GATHERING], ["rules/common.smk"]])
def test_only_what_needs_torch_imports_it(files):
    text = "\n".join(imports((WORKFLOW / file).read_text()) for file in files)
    assert "neumat" in text
    code = f"{text}\nimport sys\nprint(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "torch" not in done.stdout.split()


def test_tables_know_the_name_of_inceptions_features_without_importing_it():
    assert tables.INCEPTION == f"Frechet-{inception.NAME}"
