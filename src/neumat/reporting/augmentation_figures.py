"""What augmentation makes of materials: the six permutations of one, blends of two (M3ashy's Figs. 3 and 4)."""

import numpy as np
import torch

from neumat.augment.permutations import PERMUTATIONS
from neumat.metrics.pictures import compare_pictures
from neumat.render.tables import render_tables, table_matrix
from neumat.reporting.style import figure, save_figure

PERMUTED, BLENDED = "blue-acrylic", ("green-metallic-paint", "yellow-plastic")  # those of the paper
SHARES = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)  # of the second material of a blend
_SUBSET = 997  # every so-manieth entry tells how coloured a material is


def chosen_materials(sources):
    """Return the source numbers (permuted, (first, second)): the paper's materials, or else the most coloured ones.

    sources: an open store of at least two.
    """
    if {PERMUTED, *BLENDED} <= set(sources.names):
        return sources.names.index(PERMUTED), tuple(sources.names.index(name) for name in BLENDED)
    medians = np.array([np.median(sources.values(i, slice(None, None, _SUBSET)), 0) for i in range(sources.n)])
    saturation = 1 - medians.min(1) / np.maximum(medians.max(1), 1e-9)
    first, second = np.argsort(-saturation, kind="stable")[:2]
    return int(first), (int(first), int(second))


def permuted_pictures(store, frozen, source):
    """Return pictures, uint8 (6, H, W, 3), of a source's six permutations in AugMERL (`store`)."""
    return _pictures(store, frozen, lambda at: [store.values(6 * source + k, at) for k in range(len(PERMUTATIONS))])


def blended_pictures(store, frozen, first, second):
    """Return pictures, uint8 (2, 6, H, W, 3): blends of two sources in PCA space and in BRDF space, by SHARES."""

    def tables(at):
        a, b = (store.sources.values(i, at) for i in (first, second))
        pca = [store.blend(first, second, np.float32(1 - share), at) for share in SHARES]
        return pca + [np.float32(1 - share) * a + np.float32(share) * b for share in SHARES]

    return _pictures(store, frozen, tables).unflatten(0, (2, len(SHARES)))


def _pictures(store, frozen, tables):
    """Return the pictures of the tables (U, 3) that `tables(positions)` makes at the entries a picture needs."""
    matrix, used = table_matrix(frozen, store.entries)
    return render_tables(frozen, matrix, torch.from_numpy(np.concatenate(tables(used.numpy()), 1)))


def permutation_figure(pictures, name, path):
    """Write the six permutations of the material `name`, uint8 (6, H, W, 3), side by side as PNG."""
    with figure(len(pictures), 1.3, ncols=len(pictures)) as (drawn, axes):
        for axis, picture, order in zip(axes, pictures, PERMUTATIONS, strict=True):
            _show(axis, picture, order.upper())
        drawn.suptitle(f"{name} in the six orders of its channels (RGB: as measured)", fontsize=8)
        save_figure(drawn, path, dpi=pictures.shape[2])


def blend_figure(pictures, names, path):
    """Write blends of two materials as PNG: above in PCA space, below in BRDF space, with the PSNR between the two.

    pictures: uint8 (2, n, H, W, 3), of `blended_pictures`; names: of the two materials.
    """
    psnr, _ = compare_pictures(*pictures)
    with figure(len(SHARES), 2.6, nrows=2, ncols=len(SHARES)) as (drawn, axes):
        for row, space in enumerate(("PCA space", "BRDF space")):
            for axis, picture, share in zip(axes[row], pictures[row], SHARES, strict=True):
                _show(axis, picture, f"{100 * share:.0f} %" if row == 0 else None)
            axes[row, 0].set_ylabel(space)
        for axis, decibels in zip(axes[1], psnr, strict=True):
            axis.set_xlabel(f"{decibels:.0f} dB" if np.isfinite(decibels) else "equal")
        drawn.suptitle(f"from {names[0]} to {names[1]}; PSNR between the two rows", fontsize=8)
        save_figure(drawn, path, dpi=pictures.shape[3])


def _show(axis, picture, title):
    axis.imshow(np.asarray(picture))
    axis.set(xticks=[], yticks=[])
    axis.grid(False)
    axis.spines[:].set_visible(False)
    axis.set_title(title or "", fontweight="normal", loc="center")
