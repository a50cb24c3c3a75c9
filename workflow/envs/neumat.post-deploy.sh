#!/usr/bin/env bash
# Runs in the new environment, from the folder in which snakemake was started: the project's root.
set -euo pipefail
pip install --constraint constraints.txt --editable '.[llvm]'
