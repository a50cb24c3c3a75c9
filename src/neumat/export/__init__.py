"""Materials for other programs: every format written from 675 weights, and all but the shaders read back.

`export(weights, "merl", "out", "chrome")` writes out/chrome.binary, and `snakemake results/export/merl/chrome` writes
results/export/merl/chrome/chrome.binary: a material has one folder per format, since some formats are several files.
`read_material` takes either, the file or its folder.
"""

from neumat.export.materials import find_material
from neumat.export.reading import read_material
from neumat.export.registry import EXPORTS, export

__all__ = ["EXPORTS", "export", "find_material", "read_material"]
