"""What every script of the workflow does around its work: log, threads, one-line errors."""

import contextlib
import functools
import logging
import os
import sys
import time
from pathlib import Path

from threadpoolctl import threadpool_limits
from tqdm import tqdm

from neumat.errors import NeumatError

progress = functools.partial(tqdm, disable=None)  # a bar where a terminal is attached, else nothing


def config_file(snakemake, name):
    """Return the path of a table in config/. Its content is a param of the rule (`contents`) and not its path an input,
    which would tie results to where the workflow lies."""
    return Path(snakemake.scriptdir).resolve().parents[1] / "config" / name


@contextlib.contextmanager
def stage(snakemake):
    """Run one job's script: logging goes to its log file and to stderr.

    The log ends with the CPU time of the job, which Snakemake's benchmark takes up to 30 seconds before its end. A
    NeumatError ends in one line and exit code 1; any other exception leaves its traceback in the log as well. The
    number of threads is the rule's own (`params.torch_threads`, 1 without it) and not what the scheduler grants:
    results must not depend on the cores. torch, which jobs that only gather numbers go without, is told where it has
    been imported; else its OpenMP reads the environment when it is.
    """
    threads = snakemake.params.get("torch_threads", 1)
    os.environ["OMP_NUM_THREADS"] = str(threads)
    if "torch" in sys.modules:
        sys.modules["torch"].set_num_threads(threads)
    logging.basicConfig(
        level=logging.INFO,
        format=f"%(asctime)s {snakemake.rule}: %(message)s",
        datefmt="%H:%M:%S",
        handlers=[logging.FileHandler(snakemake.log[0], mode="w"), logging.StreamHandler()],
    )
    with threadpool_limits(threads):
        try:
            yield
        except NeumatError as error:
            logging.error("%s", error)
            sys.exit(1)
        except Exception:
            logging.exception("failed")
            sys.exit(1)
        logging.info("%.2f s of CPU time", time.process_time())
