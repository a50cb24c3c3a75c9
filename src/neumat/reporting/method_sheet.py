"""The first samples of every method in one sheet, none picked (M3ashy's Figs. 5 and 14 to 17)."""

import h5py
import numpy as np
import torch

from neumat.files import reading
from neumat.render.sphere import render_fields
from neumat.render.tables import render_combinations, table_matrix
from neumat.reporting.style import figure, save_figure
from neumat.reporting.tables import LABELS
from neumat.studies.protocols import coarse_positions


def sample_pictures(paths, count, sources, frozen):
    """Return [(n, H, W, 3) uint8]: pictures of the first `count` samples of each file, in the files' order.

    sources: the open store whose columns samples that are tables combine. Raises NeumatError for a file of no samples.
    """
    looked_up, pictures = {}, []
    for path in paths:
        with reading(path, "a file of samples (HDF5)"), h5py.File(path) as file:
            samples, kind = torch.from_numpy(file["samples"][:count]), file.attrs["kind"]
            stride = int(file.attrs["stride"])
        if kind == "weights":
            pictures.append(render_fields(frozen, samples))
            continue
        if stride not in looked_up:
            looked_up[stride] = _columns(sources, frozen, stride)
        pictures.append(render_combinations(frozen, looked_up[stride], samples))
    return pictures


def _columns(sources, frozen, stride):
    """Return the source columns (queries, 3N) at the sphere's queries, read from every stride-th entry of a table."""
    matrix, used = table_matrix(frozen, sources.entries)
    positions = coarse_positions(sources.entries, stride)[used]
    return torch.cat([matrix @ torch.from_numpy(sources.values(i, positions)) for i in range(sources.n)], 1)


def method_sheet(methods, pictures, path):
    """Write one row of pictures, uint8 (n, H, W, 3), for each method, under its label of the tables, as PNG."""
    rows, (count, height, width, _) = len(methods), pictures[0].shape
    with figure(count, 1.18 * rows * height / width, nrows=rows, squeeze=False) as (drawn, axes):
        for axis, method, row in zip(axes[:, 0], methods, pictures, strict=True):
            axis.imshow(np.concatenate(list(row), 1))
            axis.axis("off")
            axis.set_title(LABELS.get(method, method), fontsize=10, fontweight="normal", pad=2)
        save_figure(drawn, path, dpi=width)
