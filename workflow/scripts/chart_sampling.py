"""Chart 2: what samples cost and how good they are."""

from pathlib import Path

from neumat.files import atomic_path
from neumat.generative.dataset import training_dataset
from neumat.generative.hyperdiffusion import HyperDiffusion
from neumat.reporting.charts import frontier_chart
from neumat.stage import progress, stage
from neumat.studies.protocols import Protocol
from neumat.studies.sampling_sweep import sweep

with stage(snakemake):
    store, p, output = snakemake.input, snakemake.params, snakemake.output
    files = store.neumerl, store.manifest, store.sources
    default = HyperDiffusion(sampler=p.sampling["sampler"], nfe=p.sampling["nfe"], **p.hyperparameters)
    protocol = Protocol("parity", *files, p.entries, p.size, p.seed)
    dataset = training_dataset(*files, "parity", p.components, HyperDiffusion)
    table = sweep(protocol, dataset, default, p.nfes, p.shares, p.draws, p.set_size, p.sampling["seed"], progress)
    with atomic_path(output.table) as temporary:
        table.to_csv(temporary, index=False)
    # By BRDF-L1: by the distances of pictures nearly all settings are as good as true data.
    for metric, goal, title in (("one_nna", 50, "1-NNA, % (BRDF-L1)"), ("mmd", "min", "MMD (BRDF-L1)")):
        shown = table[(table["metric"] == metric) & (table["distance"] == "brdf_l1")]
        training = shown["family"] == "training"
        for rows, x, x_title, label, path in (
            (shown[~training], "sample_seconds", "Seconds of sampling", f"{default.sampler} {default.nfe}", "sampling"),
            (shown[training], "train_seconds", "Seconds of training", "1 of the steps", "training"),
        ):
            stem = Path(output[f"{path}_{metric}"]).with_suffix("")
            frontier_chart(rows, x, "value", "label", label, stem, goal, "family", x_title, title)
