"""The sections of docs/results.md on surfaces: bidirectional texture functions."""

import pandas as pd

from neumat.reporting.result_sections import Section, show
from neumat.tables import read_table

MAKE = "`make btf_all`"
QUALITY = ("surface", "representation", "texels", "pictures", "psnr", "dssim", "flip", "psnr_worst", "flip_worst")
QUALITY += ("bytes", "ns", "fit_s")
SYNTHESIS = ("surface", "representation", "method", "texels", "crops", "histogram", "spectrum", "autocovariance")
SYNTHESIS += ("ghosts", "coverage", "frechet", "repetition_scatters", "copies", "seams", "seams_scatters")
SYNTHESIS += ("bytes_ratio", "ns", "first_s")


def _leather(results):
    """Return the errors of the fits of the default surface that the run made."""
    paths = sorted((results / "btf/quality/leather").glob("[!@]*.csv"))
    table = pd.concat([read_table(path) for path in paths])
    return table.loc[(table["pairs"] == "report") & ~table["representation"].str.contains("@"), list(QUALITY)]


BTF_SECTIONS = (
    Section(
        "A captured surface, compressed and made endless",
        "The default fit of a captured surface beside pictures at two pairs of directions that it has not seen, with "
        "FLIP's map (black is no error), its errors at all held-out pairs beside those of `mean`, one BRDF for the "
        "whole patch; and what the default method makes of the exemplar over 1 to 45 exemplars.",
        ("btf/figures/leather-ours.png",),
        tables=(_leather,),
        pictures={
            "btf/figures/leather-ours.png": "Captured pictures and the default fit's",
            "btf/figures/leather-endless.png": "The exemplar made endless, by levels of detail",
        },
    ),
    Section(
        "Representations of surfaces",
        "Errors of sRGB pictures at pairs of directions that no fit saw, mean and worst; bytes, nanoseconds of a query "
        "on one core, CPU seconds of the fit. `mean` is the null, one BRDF for the whole patch. `pca` and `sh` are "
        "fitted to a grid of pictures with as many values as the random queries of the others; both triple planes have "
        "equal planes and samples. `texels` is the side of exemplar and pictures.",
        ("btf/tables/representations.csv",),
        MAKE,
        tables=(show("btf/tables/representations.csv", *QUALITY, pairs="report"),),
        pictures={
            "btf/figures/leather-representations.png": "Leather by every representation, and FLIP",
            "btf/figures/weave-representations.png": "Weave by every representation, and FLIP",
            "btf/charts/representations-bytes.png": "FLIP at held-out directions against bytes",
            "btf/charts/representations-ns.png": "FLIP at held-out directions against the time of a query",
        },
    ),
    Section(
        "Relief",
        "The same for surfaces of 0.5 to 4 times their relief: a plane of positions cannot follow how far a texel "
        "moves with the view.",
        ("btf/tables/relief.csv",),
        MAKE,
        tables=(
            show(
                "btf/tables/relief.csv",
                *("surface", "relief", "representation", "texels", "pictures", "psnr", "dssim", "flip", "flip_50_75"),
            ),
        ),
    ),
    Section(
        "Synthesis of the default surface",
        "The same statistics as in the next section, of one surface.",
        ("btf/synthesis/leather.csv",),
        "`make btf`",
        tables=(show("btf/synthesis/leather.csv", *SYNTHESIS, part="report"),),
        pictures={"btf/figures/leather-synthesis-4x.png": "Leather: exemplar, truth and every method"},
    ),
    Section(
        "Synthesis",
        "Each statistic of a synthesised picture as a ratio to that of the true surface's own crops against each other "
        "(1 is perfect). `repetition_scatters`: by how many standard deviations over crops the largest autocorrelation "
        "exceeds the truth's. `copies`: share of windows that appear again at one offset. `seams`: steps across the "
        "exemplar's borders over those elsewhere. `exemplar`, decoded, is the ceiling; `tiling`, `linear`, `shuffled` "
        "texels and `hard`, blocks of the exemplar side by side, are nulls. The default methods were chosen on other "
        "crops (`part` = `choice` in the file).",
        ("btf/tables/synthesis.csv",),
        MAKE,
        tables=(show("btf/tables/synthesis.csv", *SYNTHESIS, part="report"),),
        pictures={
            f"btf/figures/{surface}-synthesis-4x.png": f"{surface.capitalize()}: exemplar, truth and every method"
            for surface in ("weave", "stone", "wood", "metal", "bricks")
        },
    ),
    Section(
        "Rate of fits of surfaces",
        "Plain PyTorch (autograd, `embedding_bag`, Adam) and this project's training, in turns on one core; `loss` is "
        "the mean absolute error at held-out directions after equal numbers of samples. `equal_loss_seconds`: the CPU "
        "time of a whole fit that ends with the loss of plain PyTorch.",
        ("btf/tables/bench.csv",),
        MAKE,
        tables=(show("btf/tables/bench.csv"),),
    ),
    Section(
        "What a query of a surface costs",
        "Plain PyTorch (`grid_sample`, `linear`, batches of 65,536, without synthesis) and Dr.Jit, as pictures "
        "evaluate it, with and without each synthesis method. `cpu_seconds`: the quickest of three calls; "
        "`first_seconds`: the first, in which a kernel is compiled; `share`: of plain PyTorch's CPU time. The paper: "
        "2.0 ms for 2,073,600 queries on an RTX 4090.",
        ("btf/tables/queries.csv",),
        MAKE,
        tables=(show("btf/tables/queries.csv"),),
    ),
    Section(
        "Where surfaces break",
        "Each method driven to where it fails: what was expected, what happened, and what guards against it.",
        ("btf/tables/stability.csv",),
        MAKE,
        tables=(show("btf/tables/stability.csv"),),
    ),
)
