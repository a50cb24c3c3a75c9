"""The checked configuration, and what the rules share."""

import functools
import os
import re
import subprocess
import sys
from hashlib import sha256
from math import ceil
from pathlib import Path

from neumat.augment.manifest import draw_manifest
from neumat.brdf.categories import CATEGORIES
from neumat.brdf.published import merl_checksums
from neumat.config import (
    fit_files,
    inception_file,
    load,
    load_scene,
    load_surface,
    source_files,
    source_names,
)
from neumat.config_checks import (
    check,
    chosen_folds,
    folder_contents,
    made_materials,
    smaller_sets,
)
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
# Bases beyond the paper's; without any there is no such store.
DENSE = "results/neumerl/dense.h5"
DENSE_BASES = range(config["augment"]["dense"]["count"])
FOLDS = [f"fold{k}" for k in chosen_folds(config["evaluate"]["folds"], len(SOURCES))]
REPORTED = [
    f"fold{k}"
    for k in chosen_folds(config["evaluate"]["coverage"]["folds"], len(SOURCES))
]
# Protocols whose reference materials have no relative among the training materials.
UNRELATED = ["grouped", *FOLDS]
BTF = config["btf"]
# Representations whose planes are synthesised: the default's by every method, others' by the surface's default method.
SYNTHESISED = ["ours", *BTF["synthesis"]["representations"]]
# Chart 6: what fits of the surface `btf.surface` cost and how near they come. All but the planes' sizes are settings
# of the representation.
BTF_CHART = [
    *(f"{BTF['surface']}/ours@{change}" for change in BTF["chart"]["changes"]),
    *(f"{BTF['surface']}@texels={n}/ours" for n in BTF["chart"]["planes"]),
    *(f"{BTF['surface']}/{name}" for name in BTF["compared"]),
]
# Where each representation breaks: relief times 0.5 to 4, on smaller exemplars.
BTF_RELIEF = expand(
    "{surface}@relief={factor},texels={texels}/{representation}@samples={samples}",
    surface=BTF["relief"]["surfaces"],
    factor=BTF["relief"]["factors"],
    texels=BTF["relief"]["texels"],
    representation=BTF["relief"]["representations"],
    samples=BTF["relief"]["samples"],
)
TARGETS = {
    "all": [
        "results/tables/augmentation.csv",
        "results/tables/fit.csv",
        "results/tables/unconditional.csv",
        "results/tables/coverage.csv",
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
        "results/tables/things.csv",
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
        *(["results/tables/dense.csv"] if DENSE_BASES else []),
    ],
    "generalisation": [
        "results/tables/generalisation.csv",
        "results/tables/generalisation_coverage.csv",
    ],
    "btf": [
        f"results/btf/quality/{BTF['surface']}/ours.csv",
        f"results/btf/quality/{BTF['surface']}/mean.csv",
        f"results/btf/figures/{BTF['surface']}-ours.png",
        f"results/btf/synthesis/{BTF['surface']}.csv",
        f"results/btf/figures/{BTF['surface']}-synthesis-4x.png",
    ],
    "btf_all": [
        "results/btf/tables/representations.csv",
        "results/btf/tables/synthesis.csv",
        "results/btf/tables/relief.csv",
        "results/btf/tables/bench.csv",
        "results/btf/tables/queries.csv",
        "results/btf/tables/stability.csv",
        "results/btf/charts/representations.csv",
        *expand("results/scenes/{scene}.png", scene=BTF["scenes"]),
        *expand(
            "results/btf/figures/{surface}-{figure}.png",
            surface=BTF["surfaces"],
            figure=[
                "ours",
                "representations",
                *expand(
                    "synthesis-{extent}x",
                    extent=[4, BTF["truth"]["wide"]],
                ),
            ],
        ),
    ],
    "packaged": [
        "results/packaged/model.safetensors",
        "results/packaged/model.md",
    ],
    "export": [
        "results/export/safetensors/sample-0",
        *expand("results/export/{format}/blend-000@rbg", format=FORMATS),
    ],
}


# What `all` makes of the surface `btf.surface`.
SURFACE = [
    f"results/btf/quality/{BTF['surface']}/ours.csv",
    f"results/btf/figures/{BTF['surface']}-ours.png",
]


scattergather:
    fit=SHARDS,
    dense=max(1, ceil(len(DENSE_BASES) / config["fit"]["dense"]["bases_per_job"])),


wildcard_constraints:
    protocol=r"parity|grouped|everything|fold\d+",
    method="[a-z0-9-]+",
    category="|".join(CATEGORIES),
    scene="[^/]+",
    surface="[^/]+",
    capture="queries|grid|held-out",
    representation="[^/]+",
    extent=r"\d+",
    shard=r"\d+",
    shards=r"\d+",


def targets(name):
    """The files of a target."""
    return TARGETS[name] + (SURFACE if name == "all" and can_capture() else [])


@functools.cache
def can_capture():
    """Whether the files SURFACE are there or can be made; says so where they can't, for lack of LLVM and CUDA.

    That takes seconds to find out, so a plan takes it for granted.
    """
    plan = workflow.executor_plugin is None or workflow.dryrun
    if plan or is_measured(BTF["surface"]) or all(map(os.path.exists, SURFACE)):
        return True
    probe = "from neumat.render.variant import variant; print(variant())"
    found = subprocess.run(
        [sys.executable, "-c", probe], capture_output=True, text=True
    )
    if found.stdout.strip() != "scalar_rgb":
        return True
    sys.stderr.write(
        "surfaces are left out of `all`: their capture needs LLVM or CUDA, and Mitsuba found neither\n"
    )
    return False


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


def dense_of(wildcards):
    """The dense set, where there is one, for a method that is trained on it."""
    wanted = DENSE_BASES and wildcards.method != "merl100"
    wanted = wanted and hyperparameters_of(wildcards.method).get("dense")
    return {"dense": DENSE} if wanted else {}


def shard_indices(wildcards):
    """The materials that one shard fits."""
    shard, size = (
        int(wildcards.scatteritem.split("-")[0]),
        config["fit"]["materials_per_job"],
    )
    return list(FITTED[(shard - 1) * size : shard * size])


def dense_shard_indices(wildcards):
    """The dense bases that one shard fits."""
    shard, size = (
        int(wildcards.scatteritem.split("-")[0]),
        config["fit"]["dense"]["bases_per_job"],
    )
    return list(DENSE_BASES[(shard - 1) * size : shard * size])


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
    """The layout of a scene, its BTFs as Mitsuba takes them; its file is not an input, which would tie results to where
    the workflow lies."""
    try:
        layout = load_scene(
            f"{workflow.basedir}/config/scenes/{scene}.yaml",
            f"{workflow.basedir}/workflow/schemas/scene.schema.json",
        )
    except NeumatError as error:
        sys.exit(str(error))
    for item in layout["objects"].values():
        item["materials"] = [
            btf_plugin(material) if isinstance(material, dict) else material
            for material in item["materials"]
        ]
    return layout


def btf_plugin(material):
    """The Mitsuba dictionary of a BTF that a scene names: a fitted surface, or the file of a representation."""
    name = material["btf"]
    fitted = not name.endswith(".safetensors")
    method = default_synthesis(name) if fitted else BTF["synthesis"]["stochastic"]
    return {
        "type": "btf",
        "filename": f"results/btf/models/{name}/ours.safetensors" if fitted else name,
        "synthesis": material.get("synthesis", method),
        "scale": float(material.get("scale", 1.0)),
    }


def btfs_of(scene):
    """The files of the BTFs of a scene."""
    materials = [
        material
        for item in layout_of(scene)["objects"].values()
        for material in item["materials"]
    ]
    return [each["filename"] for each in materials if isinstance(each, dict)]


def variant_of(name):
    """A surface or representation, and what differs from its config: of "leather@relief=2" leather, {"relief": 2}."""
    name, _, changes = name.partition("@")
    changes = dict(change.split("=") for change in changes.split(",") if change)
    return name, {
        key: float(value) if "." in value else int(value)
        for key, value in changes.items()
    }


@functools.cache
def made():
    """The names of all materials that a run makes."""
    return made_materials(
        config, draw_manifest(SOURCES, config["augment"], config["seed"])
    )


def facet_stores(surface):
    """{material: the store with its field} of a surface's materials that are neither embedded nor files."""
    return {
        name: exported_store(name)
        for name in surface_of(surface)["materials"]
        if name not in merl_checksums() and not Path(name).is_file()
    }


def facet_inputs(surface):
    """The stores and files that a surface's materials are read from."""
    stores = facet_stores(surface)
    names = [
        name
        for name in surface_of(surface)["materials"]
        if name not in merl_checksums()
    ]
    return sorted({stores.get(name, name) for name in names})


@functools.cache
def surface_of(name):
    """The config of a surface, from config/btf where the run is, or where the workflow lies; its file is not an input,
    which would tie results to where the workflow lies."""
    name, changes = variant_of(name)
    file = Path(f"config/btf/{name}.yaml")
    try:
        surface = load_surface(
            file if file.is_file() else Path(workflow.basedir, file),
            f"{workflow.basedir}/workflow/schemas/surface.schema.json",
            made,
        )
    except NeumatError as error:
        sys.exit(str(error))
    if "relief" in surface:
        return surface | {"relief": surface["relief"] * changes.get("relief", 1)}
    if "relief" in changes:
        expected = "surfaces with a process, whose relief can be changed"
        sys.exit(str(NeumatError("config key btf.relief.surfaces", expected, name)))
    return surface


def is_measured(surface):
    """Whether a surface is a measured one."""
    return "file" in surface_of(surface)


def captured_from(surface, capture):
    """What a capture is made of: shards, or the store of a measured surface."""
    if is_measured(surface):
        return f"results/btf/measured/{variant_of(surface)[0]}.h5"
    shards = capture_shards(capture)
    folder = f"results/btf/shards/{surface}/{capture}"
    return [f"{folder}/{k}-of-{shards}.h5" for k in range(1, shards + 1)]


def measured_settings(surface):
    """The settings of the captures of a measured surface; None of others, which have been captured by settings."""
    if not is_measured(surface):
        return None
    settings = {key: config["btf"][key] for key in ("queries", "grid", "held_out")}
    texels = variant_of(surface)[1].get("texels", surface_of(surface)["texels"])
    return settings | {"shown": config["btf"]["pairs"], "texels": texels}


def truth_of(surface, extent):
    """The patch that synthesis is compared with; none of a measured surface, of which there is but the exemplar."""
    return [] if is_measured(surface) else f"results/btf/truth/{surface}-{extent}x.h5"


def capture_settings(capture, surface):
    """The settings of a capture of a surface: of random queries, of a grid of pictures, of held-out ones, of a truth."""
    shared = {key: config["btf"][key] for key in ("texels", "quads", "bounces")}
    shared |= {"texels": variant_of(surface)[1].get("texels", shared["texels"])}
    shown = {"shown": config["btf"]["pairs"]} if capture == "held-out" else {}
    return shared | shown | config["btf"][capture.replace("-", "_")]


def truth_settings(surface, extent):
    """The settings of a patch of a surface: a wide one has larger texels, as large as figures show it."""
    truth, shared = config["btf"]["truth"], capture_settings("queries", surface)
    found = {"pairs": config["btf"]["pairs"], "samples": truth["samples"]}
    found |= {key: shared[key] for key in ("texels", "quads", "bounces")}
    if extent != truth["extent"]:
        larger = shared["texels"] // min(truth["wide_texels"], shared["texels"])
        found |= {
            "texels": shared["texels"] // larger,
            "samples": truth["wide_samples"],
        }
        found["quads"] = shared["quads"] * min(larger, 2)
    return found


def capture_shards(capture):
    """How many jobs share a capture."""
    given = config["btf"][capture.replace("-", "_")]
    sweeps = {
        "queries": lambda: given["sweeps"],
        "grid": lambda: sum(given["count"]) ** 2,
        "held-out": lambda: given["validation"]
        + given["report"]
        + len(config["btf"]["pairs"]),
    }[capture]()
    return ceil(sweeps / config["btf"]["sweeps_per_job"])


def default_synthesis(surface):
    """The default synthesis method for a surface."""
    structured = surface_of(surface)["structured"]
    return config["btf"]["synthesis"]["structured" if structured else "stochastic"]


def shown_of(extent):
    """The extent of the truth of which figures show `extent` exemplars along a side."""
    truth = config["btf"]["truth"]
    return truth["extent"] if extent <= truth["extent"] else truth["wide"]


def judged_by(surface):
    """The surface whose held-out pictures a fit is judged by: with a smaller plane, those of the whole exemplar."""
    return re.sub(r"@texels=\d+$", "", surface)


def captured_for(representation):
    """The capture that a representation is fitted to: two need all pairs of a grid of directions."""
    return "grid" if variant_of(representation)[0] in ("pca", "sh") else "queries"


def representation_of(name):
    """The hyperparameters of a representation."""
    name, changes = variant_of(name)
    return config["btf"]["representations"].get(name, {}) | changes
