"""One look for every chart: small sans-serif type, no box, colours that colour-blind readers tell apart."""

import contextlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from neumat.files import atomic_path

# Okabe and Ito's palette, less the yellow, which is too light for lines on white.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")  # one more than colours: an eighth group differs from the first
MUTED = "#767676"
ACCENT = "#D55E00"

_SETTINGS = {
    "font.family": "DejaVu Sans",
    "font.size": 8,
    "axes.titlesize": 9,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": MUTED,
    "axes.linewidth": 0.6,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#E6E6E6",
    "grid.linewidth": 0.6,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": "black",
    "ytick.labelcolor": "black",
    "legend.frameon": False,
    "svg.hashsalt": "neumat",  # the same chart gives the same file
    "savefig.dpi": 200,
}
_LEAST_DPI = 100


@contextlib.contextmanager
def figure(width, height, **subplots):
    """Yield (figure, axes) of `width` x `height` inches in the common style; closed at the end."""
    with plt.rc_context(_SETTINGS):
        drawn, axes = plt.subplots(figsize=(width, height), layout="constrained", **subplots)
        try:
            yield drawn, axes
        finally:
            plt.close(drawn)


def save_figure(drawn, path, dpi=_SETTINGS["savefig.dpi"]):
    """Write a figure as the picture `path`, at `dpi` pixels per inch, but no fewer than its type needs."""
    with atomic_path(path) as temporary:
        drawn.savefig(temporary, dpi=max(dpi, _LEAST_DPI))


def save_chart(drawn, path_stem):
    """Write a figure as `path_stem`.png and .svg; the same chart gives the same files."""
    for suffix in (".png", ".svg"):
        with atomic_path(f"{path_stem}{suffix}") as temporary:
            drawn.savefig(temporary, metadata={"Date": None} if suffix == ".svg" else None)
