"""A job's threads are its rule's, whatever the scheduler or the environment grants."""

import os
import subprocess
import sys

import pytest

JOB = """
import logging
from types import SimpleNamespace
{first}
from neumat.stage import stage
with stage(SimpleNamespace(params={params}, rule="job", log=["log.txt"])):
    import torch
    print(torch.get_num_threads())
"""


@pytest.mark.parametrize(("first", "params", "threads"), [("", {"torch_threads": 2}, 2), ("import torch", {}, 1)])
def test_threads_are_the_rules_own_whenever_torch_is_imported(tmp_path, first, params, threads):
    code = JOB.format(first=first, params=params)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path,
                          env={**os.environ, "OMP_NUM_THREADS": "4"})  # fmt: skip
    assert done.stdout.split() == [str(threads)], done.stderr
