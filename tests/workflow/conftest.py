"""What the workflow's tests share."""

import os

import pytest
from runner import run


@pytest.fixture(scope="session")
def smoke(tmp_path_factory):
    """The folder of a finished smoke run of all targets on two cores."""
    folder = tmp_path_factory.mktemp("smoke")
    run(folder, "--cores", "2", "--", "smoke")
    return folder


@pytest.fixture(autouse=True)
def plain_environment(monkeypatch):
    """No profile or option of whoever runs the tests."""
    for name in [name for name in os.environ if name.startswith("SNAKEMAKE_")]:
        monkeypatch.delenv(name)
