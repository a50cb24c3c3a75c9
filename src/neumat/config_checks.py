"""What of a configuration can be wrong beyond its schema, and can be known before anything runs."""

import re
from pathlib import Path

from neumat.augment.manifest import draw_manifest, fold_count, protocol_indices
from neumat.brdf.categories import check_rules
from neumat.config import SUFFIXES, load_scene
from neumat.errors import NeumatError

SMALLEST = 2  # materials of a side, between which there is a distance


def check(config, names, scenes, scene_schema):
    """Raise NeumatError for the first mistake that a run would only find later.

    config: of `load`; names: of `source_names`; scenes: the folder of the scenes' files; scene_schema: a path.
    """
    check_rules(config["constrained"]["rules"])
    _ascending("augment.weight_range", config["augment"]["weight_range"])
    if not sum(config["augment"]["dense"]["parents"][:2]) > 0:  # a side of the grouped split may have two sources only
        found = config["augment"]["dense"]["parents"]
        raise NeumatError("config key augment.dense.parents", "a share of bases of one or two sources", found)
    levels = config["generative"]["methods"]["hyperdiffusion"]
    pair = [levels["sigma_min"], levels["sigma_max"]]
    _ascending("generative.methods.hyperdiffusion.sigma_min and sigma_max", pair, strict=True)
    _check_btf(config["btf"])
    tolerances = config["scenes"]["tolerances"]
    if config["scenes"]["tolerance"] not in tolerances:
        expected = f"one of scenes.tolerances, {', '.join(map(str, tolerances))}"
        raise NeumatError("config key scenes.tolerance", expected, config["scenes"]["tolerance"])
    manifest = draw_manifest(names, config["augment"], config["seed"])
    check_sides(manifest, config["evaluate"])
    shown = manifest["base"][protocol_indices(manifest, "parity")[1]].nunique()
    if shown < SMALLEST:  # one for validation, one for the report
        raise NeumatError("config key augment.held_out", "held-out materials of two bases to show", shown)
    folds = {"folds": config["evaluate"]["folds"], "coverage.folds": config["evaluate"]["coverage"]["folds"]}
    for key, given in folds.items():
        if not chosen_folds(given, len(names)):
            expected = f"a fold below {fold_count(len(names))}, as many as {len(names)} sources have"
            raise NeumatError(f"config key evaluate.{key}", expected, given)
    _check_scenes(config, manifest, Path(scenes), scene_schema)


def _check_btf(btf):
    """Raise NeumatError where the config's section `btf` contradicts itself."""
    texels = btf["texels"] ** 2
    if texels % btf["queries"]["pairs"]:
        raise NeumatError("config key btf.queries.pairs", f"a divisor of {texels}, the texels", btf["queries"]["pairs"])
    theta, count = btf["grid"]["theta"], btf["grid"]["count"]
    if len(theta) != len(count):
        raise NeumatError("config key btf.grid.count", f"{len(theta)} numbers, as many as angles", len(count))


def chosen_folds(folds, n):
    """Return those of the configured folds that n sources have."""
    return [k for k in folds if k < fold_count(n)]


def check_sides(manifest, evaluate):
    """Raise NeumatError where a side of a protocol of the config's section `evaluate` is too small for its tables: one
    without two materials, or a training side with fewer than a set."""
    for protocol, training, reference in _sides(manifest, evaluate["protocols"]):
        for side, count in (("training", training), ("reference", reference)):
            if count < SMALLEST:
                expected = f"a share for which {protocol} has at least {SMALLEST} {side} materials"
                raise NeumatError("config key augment.held_out", expected, count)
        if training < evaluate["set_size"]:
            expected = f"at most {training}, the training materials of {protocol}"
            raise NeumatError("config key evaluate.set_size", expected, evaluate["set_size"])


def smaller_sets(config, names):
    """Return a line that names the protocols, folds included, whose reference set is smaller than `evaluate.set_size`:
    there as many samples as references are compared. Empty where none is."""
    evaluate = config["evaluate"]
    folds = [f"fold{k}" for k in chosen_folds(evaluate["folds"], len(names))]
    manifest = draw_manifest(names, config["augment"], config["seed"])
    sides = _sides(manifest, dict.fromkeys([*evaluate["protocols"], "grouped", *folds]))
    few = [f"{protocol} {count}" for protocol, _, count in sides if count < evaluate["set_size"]]
    size = evaluate["set_size"]
    return (
        f"config key evaluate.set_size: not {size} but all references are compared of {', '.join(few)}\n" if few else ""
    )


def _sides(manifest, protocols):
    return [(protocol, *map(len, protocol_indices(manifest, protocol))) for protocol in protocols]


def folder_contents(key, folder, suffix=SUFFIXES["rgl"]):
    """Return the files of one kind, sorted, in the folder that the config's `key` names; none where it is null.

    Raises NeumatError where it is no folder or holds no such file.
    """
    if folder is None:
        return []
    expected, path = f"a folder of {suffix} files", Path(folder)
    try:
        files = sorted(str(file) for file in path.iterdir() if file.suffix.lower() == suffix and file.name[0] != ".")
    except OSError as error:
        raise NeumatError(f"config key {key}", expected, f"{folder}: {error.strerror}") from error
    if not files:
        raise NeumatError(f"config key {key}", expected, f"none in {folder}")
    return files


def _ascending(key, pair, strict=False):
    if pair[0] > pair[1] or (strict and pair[0] == pair[1]):
        raise NeumatError(f"config key {key}", "two ascending numbers", pair)


def sample_count(config):
    """Return how many materials the default diffusion model samples."""
    return config["evaluate"]["draws"] * config["evaluate"]["set_size"]


def made_materials(config, manifest):
    """Return the names of all materials that a run makes: of the manifest, and sample-0 on."""
    return {*manifest["name"], *(f"sample-{k}" for k in range(sample_count(config)))}


def _check_scenes(config, manifest, folder, schema):
    known = made_materials(config, manifest)
    for scene in config["scenes"]["names"]:
        path = folder / f"{scene}.yaml"
        if not path.is_file():
            raise NeumatError("config key scenes.names", f"names of files in {folder.name}", f"no {path.name}")
        for name, item in load_scene(path, schema)["objects"].items():
            for material in item["materials"]:
                if isinstance(material, dict):
                    continue
                ranked = re.fullmatch(r"(?:sources|samples)@(\d(?:\.\d+)?)", material)
                if material not in known and not (ranked and float(ranked[1]) <= 1):
                    of_model = f"sample-0 to sample-{sample_count(config) - 1}, sources@<0..1> or samples@<0..1>"
                    expected = f"the name of a source or blend, {of_model}"
                    raise NeumatError(f"{path}: key objects.{name}.materials", expected, repr(material))
