"""The checked configuration, and what the rules share."""

import re
import sys
from hashlib import sha256
from math import ceil
from pathlib import Path

from neumat.brdf.categories import CATEGORIES
from neumat.config import (
    fit_files,
    inception_file,
    load,
    load_scene,
    source_files,
    source_names,
)
from neumat.config_checks import check, chosen_folds, folder_contents, smaller_sets
from neumat.errors import NeumatError
from neumat.provenance import digest

try:
    config = load(config, f"{workflow.basedir}/workflow/schemas/config.schema.json")
    SOURCE_FILES = list(source_files(config["sources"]).values())
    SOURCES = source_names(config["sources"])
    MEASURED = fit_files(config["fit"])
    INCEPTION = inception_file(config["evaluate"])
    PICTURED = folder_contents(
        "conditional.measured", config["conditional"]["measured"]
    )
    check(
        config,
        SOURCES,
        f"{workflow.basedir}/config/scenes",
        f"{workflow.basedir}/workflow/schemas/scene.schema.json",
    )
    if workflow.is_main_process:  # and not in every job
        sys.stderr.write(smaller_sets(config, SOURCES))
except NeumatError as error:
    sys.exit(str(error))

if config["sources"]["url"]:
    SOURCE_FILES = ["results/sources/downloaded.tsv"]

SOURCES_STORE = "results/sources/sources.h5"
STORE = "results/augmerl/augmerl.h5"
MANIFEST = "results/augmerl/manifest.tsv"
NEUMERL = "results/neumerl/neumerl.h5"
SAMPLES = "results/samples/parity/hyperdiffusion.h5"
# Those of neumat.export.EXPORTS, whose import would take every run of snakemake two seconds.
FORMATS = ["merl", "rgl", "npy", "keras", "safetensors", "glsl", "wgsl"]
# Materials that are fitted: every one, or one of each six that differ in the order of their colours.
FITTED = range(
    0,
    6 * (len(SOURCES) + config["augment"]["blends"]),
    1 if config["fit"]["independent"] else 6,
)
SHARDS = ceil(len(FITTED) / config["fit"]["materials_per_job"])
FOLDS = [f"fold{k}" for k in chosen_folds(config["evaluate"]["folds"], len(SOURCES))]
# Protocols whose reference materials have no relative among the training materials.
UNRELATED = ["grouped", *FOLDS]
TARGETS = {
    "all": [
        "results/tables/augmentation.csv",
        "results/tables/fit.csv",
        "results/tables/unconditional.csv",
        "results/tables/novelty.csv",
        "results/tables/renderer.csv",
        "results/tables/physics.csv",
        *expand("results/scenes/{scene}.png", scene=config["scenes"]["names"]),
        "results/figures/contact.png",
        "results/figures/nearest.png",
        "results/figures/heatmap.png",
        "results/figures/grid.png",
        "results/figures/methods.png",
        "results/figures/permutations.png",
        "results/figures/blends.png",
        "results/tables/conditional.csv",
        "results/charts/guidance.png",
        "results/tables/categories.csv",
        "results/figures/kmeans.png",
        "results/tables/constrained.csv",
        "results/figures/by-category.png",
        *expand(
            "results/constrained/{way}{category}.png",
            way=["", "guided/"],
            category=config["constrained"]["categories"],
        ),
        "results/tables/stability_conditional.csv",
        "results/tables/stability_render.csv",
    ],
    "charts": [
        "results/charts/fit.csv",
        "results/charts/sampling.csv",
        "results/charts/bsdf.csv",
        "results/tables/ladder.csv",
        "results/charts/models.csv",
        "results/tables/text_ablation.csv",
    ],
    "generalisation": [
        "results/tables/generalisation.csv",
        "results/tables/generalisation_novelty.csv",
    ],
    "export": [
        "results/export/safetensors/sample-0",
        *expand("results/export/{format}/blend-000@rbg", format=FORMATS),
    ],
}


scattergather:
    fit=SHARDS,


wildcard_constraints:
    protocol=r"parity|grouped|fold\d+",
    method="[a-z0-9-]+",
    category="|".join(CATEGORIES),
    scene="[^/]+",


def code(script):
    """The digest of a script and of what it imports: a changed module reruns the stage, a comment does not."""
    return digest(f"{workflow.basedir}/workflow/scripts/{script}.py")


def contents(path):
    """The digest of a file of the repository: as an input it would tie results to where the workflow lies."""
    return sha256(Path(workflow.basedir, path).read_bytes()).hexdigest()[:16]


def section(name, *unused):
    """A section of the config without the keys that the rule does not use."""
    return {key: value for key, value in config[name].items() if key not in unused}


def methods_of(protocol):
    """The methods that are trained and scored under a protocol."""
    evaluate = config["evaluate"]
    in_all = protocol in evaluate["protocols"]
    return evaluate["methods" if in_all else "generalisation_methods"]


def hyperparameters_of(method):
    """A method's own; a null among a network's arguments leaves the network's default."""
    # MERL100 is the same model on other data.
    given = dict(
        config["generative"]["methods"][
            "hyperdiffusion" if method == "merl100" else method
        ]
    )
    if "network" in given:
        given["network"] = {
            key: value for key, value in given["network"].items() if value is not None
        }
    return given


def shard_indices(wildcards):
    """The materials that one shard fits."""
    shard, size = (
        int(wildcards.scatteritem.split("-")[0]),
        config["fit"]["materials_per_job"],
    )
    return list(FITTED[(shard - 1) * size : shard * size])


def exported_store(material):
    """The store with the weights of a material of the manifest, or of a sample of the diffusion model."""
    return SAMPLES if re.fullmatch(r"sample-\d+", material) else NEUMERL


def projection_of(power):
    """The section `conditional.projection`; a power named in the file, as in @0.5, in place of the configured one."""
    given = config["conditional"]["projection"]
    return given | {"power": float(power[1:])} if power else given


def conditional_model(power):
    """The conditional model of a power of the projection; the configured one's is that which serves requests."""
    if power == config["conditional"]["projection"]["power"]:
        return CONDITIONAL
    return f"results/conditional/model@{power:g}.safetensors"


def layout_of(scene):
    """The layout of a scene; its file is not an input, which would tie results to where the workflow lies."""
    try:
        return load_scene(
            f"{workflow.basedir}/config/scenes/{scene}.yaml",
            f"{workflow.basedir}/workflow/schemas/scene.schema.json",
        )
    except NeumatError as error:
        sys.exit(str(error))
