"""The 100 published MERL files, by name."""

import csv
from importlib import resources


def merl_checksums():
    """Return {name: (sha256, bytes)} of the 100 original MERL files."""
    text = (resources.files("neumat.brdf") / "data" / "merl_sha256.csv").read_text()
    return {row["material"]: (row["sha256"], int(row["bytes"])) for row in csv.DictReader(text.splitlines())}
