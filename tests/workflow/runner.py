"""The workflow, run as its user runs it, in folders of its own."""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
SMOKE = ROOT / "config/smoke.yaml"


def command(folder, *arguments, overlays=(SMOKE,), root=ROOT):
    """Return the command line of snakemake on the workflow in `root`, working in `folder`."""
    configs = ["--configfile", *overlays] if overlays else []
    base = [sys.executable, "-m", "snakemake", "--snakefile", root / "Snakefile", "--directory", folder]
    return [str(part) for part in [*base, *configs, *arguments]]


def run(*arguments, **options):
    """Run snakemake and return the finished process; fails the test where it fails."""
    done = subprocess.run(command(*arguments, **options), capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done


def planned(folder, *arguments, **options):
    """Return the names of the rules that a run would run, targets left out."""
    done = run(folder, "--dry-run", *arguments, **options)
    rules = set(re.findall(r"^(?:local)?rule (\w+):", done.stdout + done.stderr, re.MULTILINE))
    return rules - {"all", "charts", "generalisation", "btf", "btf_all", "packaged", "smoke"}
