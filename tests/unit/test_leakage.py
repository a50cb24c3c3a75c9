"""Which materials each stage may see. docs/leakage.md says how these tests work.

A toy run of twelve sources and ten blends, each of whose 132 fields differs from all others: whatever a stage was
given can be told from what it was given. Expected sides come from the columns of the manifest, not from the code that
the stages ask.
"""

import functools
import runpy
from pathlib import Path
from types import SimpleNamespace

import h5py
import numpy as np
import pandas as pd
import pytest
import torch
from safetensors.torch import load_file

from neumat.augment.manifest import draw_manifest
from neumat.augment.permutations import PERMUTATIONS
from neumat.brdf.coordinates import above_horizon, grid_angles
from neumat.brdf.types import read_types, type_names, type_rows
from neumat.conditions import training
from neumat.conditions.choice import Seen
from neumat.conditions.projection import Projection
from neumat.conditions.store import Conditions, read_conditions, write_conditions
from neumat.conditions.synthesis import Synthesiser
from neumat.fields.field import evaluate
from neumat.fields.layout import permute_channels
from neumat.fields.store import PER_MATERIAL, write_neumerl
from neumat.generative.baselines import Copies, Merl100
from neumat.generative.conditional import ConditionalDiffusion
from neumat.generative.dataset import training_dataset
from neumat.generative.hyperdiffusion import HyperDiffusion
from neumat.generative.orders import reorder
from neumat.generative.registry import METHODS
from neumat.metrics.novelty import nearest_training
from neumat.render.sphere import FrozenSphere
from neumat.studies import constrained, coverage, protocols, request_bench
from neumat.studies.protocols import TRAINING_SET, Protocol, score_protocol
from neumat.studies.type_scorer import TypeScorer

PROTOCOLS = ["parity", "grouped", *(f"fold{k}" for k in range(5))]
SCRIPTS = Path(__file__).parents[2] / "workflow/scripts"
LETTERS = "abcdefghijkl"
SMALL = functools.partial(FrozenSphere, 16, 4, 8)


class Named(dict):
    """A named list of Snakemake's: items by name, as attributes, and by position."""

    def __getattr__(self, name):
        return self[name]

    def __getitem__(self, key):
        return list(self.values())[key] if isinstance(key, int) else super().__getitem__(key)


def sides(rows, protocol):
    """Return (train, reference), sets of indices, by the columns of the manifest."""
    if protocol == "everything":
        return set(rows["index"]), set()
    if protocol.startswith("fold"):
        held = set(rows["base"][(rows["parent_a"] == rows["parent_b"]) & (rows["fold"] == int(protocol[4:]))])
        reference = set(rows["index"][rows["base"].isin(held)])
        return set(rows["index"][~(rows["parent_a"].isin(held) | rows["parent_b"].isin(held))]), reference
    test = rows["random" if protocol == "parity" else "grouped"] == "test"
    return set(rows["index"][~test]), set(rows["index"][test])


def which(found, table):
    """Return the index of each row of `found` (k, ...) among the rows of `table` (n, ...), of which it must be one."""
    distance = torch.cdist(torch.as_tensor(found).flatten(1).double(), torch.as_tensor(table).flatten(1).double())
    nearest = distance.min(1)
    assert nearest.values.max() < 1e-3
    return nearest.indices.tolist()


@pytest.fixture(scope="module")
def run(tmp_path_factory, field):
    """Paths of the toy run's stores, its manifest, its fields and its conditions."""
    folder = tmp_path_factory.mktemp("run")
    names = [f"mat-{letter}" for letter in LETTERS]
    rows = draw_manifest(names, {"blends": 10, "weight_range": [0.3, 0.7], "held_out": 0.2}, 0)
    generator = np.random.default_rng(0)
    base = [
        field(generator.uniform(0.02, 0.9, 3), generator.uniform(0.5, 50), generator.uniform(5, 100))
        for _ in range(len(rows) // len(PERMUTATIONS))
    ]
    weights = torch.stack([permute_channels(w[None], order)[0] for w in base for order in PERMUTATIONS])
    paths = {name: folder / f"{name}.h5" for name in ("neumerl", "sources", "conditions")}
    paths |= {name: folder / f"{name}.tsv" for name in ("manifest", "types", "prompts")}
    rows.to_csv(paths["manifest"], sep="\t", index=False)
    write_neumerl(paths["neumerl"], rows, weights, {key: np.ones(len(rows)) for key in PER_MATERIAL}, {})
    entries = torch.nonzero(above_horizon())[::4000, 0].numpy().astype(np.int32)
    with h5py.File(paths["sources"], "w") as file:
        file["names"], file["entries"] = names, entries
        file["columns"] = generator.gamma(1, 1, (3 * len(names), len(entries))).astype(np.float16)
        file.attrs.update(schema_version=1, digest="", kind="fake", config="{}")
    types = [(n, f"type{k // 2}", ("metal", "plastic")[k % 2], 3 * n[-1]) for k, n in enumerate(names)]
    pd.DataFrame(types, columns=["name", "type", "family", "description"]).to_csv(paths["types"], sep="\t", index=False)
    prompts = pd.DataFrame({"prompt": [3 * letter for letter in LETTERS], "colour": "", "gloss": "", "family": ""})
    prompts = pd.concat(
        [prompts.assign(use="report"), prompts[:2].assign(prompt=["yyy", "zzz"], use=["earlier", "validation"])]
    )
    prompts.to_csv(paths["prompts"], sep="\t", index=False)
    table = read_types(paths["types"])
    facts = pd.DataFrame({"name": rows["name"], "colour": "red", "gloss": "matte", "thing": "thing", "family": "metal"})
    text, image = (torch.from_numpy(generator.normal(size=(len(rows), 2, 8))).float() for _ in range(2))
    said = [["a text", "another"]] * len(rows)
    known = torch.from_numpy(type_rows(rows, table))
    write_conditions(paths["conditions"], Conditions("toy", type_names(rows, table), known, facts, said, text, image))
    paths = {name: str(path) for name, path in paths.items()}
    return SimpleNamespace(paths=paths, rows=rows, weights=weights, conditions=read_conditions(paths["conditions"]))


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """Small spheres, and features that cost nothing."""
    monkeypatch.setattr(protocols, "FrozenSphere", lambda size: SMALL())
    monkeypatch.setattr(request_bench, "FrozenSphere", lambda *size, environment: SMALL(environment=environment))
    monkeypatch.setattr(protocols.frechet, "features", lambda images: images.flatten(1)[:, ::50].float())


def protocol_of(run, name, entries=128):
    stores = (run.paths[key] for key in ("neumerl", "manifest", "sources"))
    return Protocol(name, *stores, entries, 16, 0)


def script(name, run, tmp_path, params=(), wildcards=(), **inputs):
    """Run a script of the workflow on the toy run and return the path of its output."""
    output = tmp_path / f"{name}.out"
    lists = {
        "input": {**run.paths, **inputs},
        "params": {"seed": 0, "entries": 128, "size": 16, **dict(params)},
        "wildcards": dict(wildcards),
        "output": {"output": str(output), **{k: str(tmp_path / k) for k in ("table", "nearest", "heatmap")}},
    }
    job = {name: Named(values) for name, values in lists.items()}
    job = SimpleNamespace(**job, log=[tmp_path / "log"], rule=name, scriptdir=str(SCRIPTS))
    runpy.run_path(str(SCRIPTS / f"{name}.py"), {"snakemake": job})
    return output


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_the_sides_share_no_material_and_but_for_parity_no_ancestor(run, protocol):
    train, reference = sides(run.rows, protocol)
    assert train and reference and not train & reference
    ancestors = [
        set(run.rows.loc[sorted(side), ["parent_a", "parent_b"]].to_numpy().flat) for side in (train, reference)
    ]
    assert bool(ancestors[0] & ancestors[1]) == (protocol == "parity")
    found = protocol_of(run, protocol)
    assert (set(found.train), set(found.reference)) == (train, reference)


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_every_method_is_trained_on_the_training_side_alone(run, protocol, tmp_path):
    train, _ = sides(run.rows, protocol)
    params = {"hyperparameters": {}, "components": 10, "checkpoint": None}
    output = script("train", run, tmp_path, params, {"protocol": protocol, "method": "copies"})
    assert sorted(which(load_file(output)["weights"], run.weights)) == sorted(train)
    stores = [run.paths[key] for key in ("neumerl", "manifest", "sources")]
    for model in {model.kind + str(model.stride): model for model in METHODS.values()}.values():
        dataset = training_dataset(*stores, protocol, 10, model)
        assert which(dataset.weights, run.weights) == sorted(train)
        rows = run.rows.loc[sorted(train)]
        assert (dataset.base * len(PERMUTATIONS) + dataset.permutation == rows["index"]).all()
        if dataset.coefficients is not None:
            # A source's table is made of its own three columns and nothing else.
            plain = dataset.coefficients[dataset.is_source].reshape(-1, 3, len(LETTERS), 3).any((1, 3))
            names = np.array([f"mat-{letter}" for letter in LETTERS])
            assert (names[plain.argmax(1)] == rows["base"][dataset.is_source]).all() and (plain.sum(1) == 1).all()


def test_merl100_sees_the_measured_materials_of_the_training_side(run, monkeypatch):
    seen = []
    monkeypatch.setattr(HyperDiffusion, "_fit", lambda self, dataset, *rest: seen.append(dataset) or {})
    stores = [run.paths[key] for key in ("neumerl", "manifest", "sources")]
    Merl100().fit(training_dataset(*stores, "parity", 10, Merl100), 0)
    rows = run.rows.loc[sorted(sides(run.rows, "parity")[0])]
    own = rows["index"][(rows["parent_a"] == rows["parent_b"]) & (rows["permutation"] == "rgb")]
    assert which(seen[0].weights, run.weights) == list(own)


def by_hand(run, protocol, indices):
    """Return the mean |log(1 + f) - log(1 + f')| (n, 132) of materials with all, at the protocol's entries."""
    values = evaluate(run.weights, *grid_angles(protocol.entries)).log1p().flatten(1).double()
    return torch.cdist(values[indices], values, p=1) / values.shape[1]


@pytest.mark.parametrize("name", PROTOCOLS)
def test_scores_compare_the_right_sides(run, name, tmp_path):
    protocol, (train, reference) = protocol_of(run, name), sides(run.rows, name)
    train, reference = sorted(train), sorted(reference)
    with h5py.File(tmp_path / "samples.h5", "w") as file:
        file["samples"] = run.weights[reference].numpy()
        file.attrs.update(kind="weights", stride=1)
    scores = score_protocol(protocol, {"held": tmp_path / "samples.h5"}, 1, len(reference), "")
    nearest = by_hand(run, protocol, reference)[:, train].amin(1)
    # Samples that are the reference match it; draws of the training set match it no better than training does.
    mmd = scores[(scores["metric"] == "mmd") & (scores["distance"] == "brdf_l1_log")].set_index("method")["value"]
    assert mmd["held"] < 1e-5
    assert mmd[TRAINING_SET] >= (1 - 1e-4) * nearest.mean().item() > 0


@pytest.mark.parametrize("name", PROTOCOLS)
def test_draws_of_the_training_set_are_of_training_materials_each_once(run, name):
    protocol, (train, _) = protocol_of(run, name, 64), sides(run.rows, name)
    drawn = which(protocol.training_draws(3, 10).brdf, evaluate(run.weights, *grid_angles(protocol.entries)))
    assert set(drawn) <= train
    assert [len(set(drawn[k : k + 10])) for k in (0, 10, 20)] == [10] * 3


@pytest.mark.parametrize("name", PROTOCOLS[2:])
def test_coverage_and_nulls_hold_out_sources_and_all_that_descends_from_them(run, name):
    """Nulls that keep materials as they are, and the sides that all others are made of."""
    stores = [run.paths[key] for key in ("neumerl", "manifest", "sources")]
    recipe = {"parents": [1, 1, 1], "logarithmic": 0.5, "brightness": 1.5, "mixing": 1.0}
    found = coverage.Sides(name, stores, 64, recipe, 0)
    train, reference = sides(run.rows, name)
    plain = set(run.rows["index"][run.rows["permutation"] == "rgb"])
    measured = set(run.rows["index"][run.rows["parent_a"] == run.rows["parent_b"]])
    expected = {"training": train & plain, "sources": train & plain & measured, "held_out": reference & plain}
    assert {side: set(which(weights, run.weights)) for side, weights in found.weights.items()} == expected
    assert found.names == [run.rows["base"][i] for i in sorted(expected["sources"])]
    for side, indices in expected.items():
        assert torch.equal(getattr(found, side).brdf, found.fields(run.weights[sorted(indices)]).brdf)
    model = SimpleNamespace(draw=lambda n, seed: run.weights[sorted(train & plain)].repeat(9, 1)[:n])
    rows = coverage.measure(found, model, (2, 60), 0)
    rows = rows.set_index(["method", "level", "measure", "size"])["value"]
    x, y = (m.brdf.log1p().flatten(1) for m in (found.held_out, found.training))
    own = torch.cdist(x, y, p=1).amin(1) / x.shape[1]
    for method in ("copies", "hyperdiffusion"):
        assert rows.loc[method, 0, "coverage", 60].to_numpy() == pytest.approx(own.numpy(), rel=1e-3)
    assert rows.loc["copies", 0, "novelty, bases", 60].item() < 1e-6
    assert set(rows.index.get_level_values("method")) == {"held-out", "hyperdiffusion", *coverage.NULLS}
    assert np.isfinite(rows.loc[:, :, "coverage"]).all()


def test_categories_are_compared_with_training_materials(run, monkeypatch, tmp_path):
    """Every material belongs to the category, so that every one that may be looked at is."""
    protocol, (train, reference) = protocol_of(run, "parity"), map(sorted, sides(run.rows, "parity"))
    everything = pd.DataFrame(True, index=run.rows.index, columns=["diffuse"])
    monkeypatch.setattr(constrained, "categorise", lambda statistics, rules: everything)
    attributes = {
        "category": "diffuse",
        "way": "",
        "wanted": 1,
        "tried": 1,
        "accepted": 1,
        "invalid": 0,
        "seconds": 1.0,
    }
    for side, expected in ((reference, by_hand(run, protocol, reference)[:, train].amin(1).median()), (train, 0.0)):
        monkeypatch.setattr(constrained, "read_found", lambda path, side=side: (run.weights[side], attributes))
        row = constrained.constrained_table(["found"], protocol, None, None, 1).iloc[0]
        assert row["nearest_member"] == pytest.approx(float(expected), rel=1e-4, abs=1e-5)


def test_the_sweep_of_samplers_trains_and_compares_on_its_sides(run, monkeypatch, tmp_path):
    seen = []
    monkeypatch.setattr("neumat.studies.sampling_sweep.sweep", lambda *given: seen.append(given) or SystemExit())
    params = {"sampling": {"sampler": "heun", "nfe": 8, "seed": 0}, "hyperparameters": {}, "components": 10}
    params |= dict.fromkeys(("nfes", "shares", "draws", "set_size"), 1)
    with pytest.raises(SystemExit):  # the table is none
        script("chart_sampling", run, tmp_path, params)
    protocol, dataset, *_ = seen[0]
    train, reference = sides(run.rows, "parity")
    assert which(dataset.weights, run.weights) == sorted(train) and set(protocol.reference) == reference


def test_figures_of_novelty_show_the_nearest_training_materials(run, monkeypatch, tmp_path):
    train, reference = sides(run.rows, "parity")
    with h5py.File(tmp_path / "samples.h5", "w") as file:
        file["samples"] = run.weights[sorted(reference)].numpy()
        file.attrs.update(kind="weights", stride=1)
    shown, tables = [], []
    monkeypatch.setattr("neumat.reporting.figures.nearest_figure", lambda *given: shown.append(given))
    monkeypatch.setattr("neumat.reporting.figures.heat_map", lambda table, *rest, **options: tables.append(table))
    script("novelty_figures", run, tmp_path, {"set_size": len(reference)}, samples=str(tmp_path / "samples.h5"))
    protocol = protocol_of(run, "parity")
    nearest = np.array(sorted(train))[by_hand(run, protocol, sorted(reference))[:, sorted(train)].argmin(1)]
    assert torch.equal(shown[0][1], protocol.materials(nearest[:36]).images)
    assert tables[0].shape == (len(reference),) * 2 and tables[0].diagonal().max() < 1e-9


@pytest.mark.parametrize("protocol", ["parity", "everything"])
def test_texts_and_images_are_projected_by_training_materials(run, protocol, monkeypatch, tmp_path):
    seen = []
    monkeypatch.setattr(Projection, "fit", lambda encoder, *given, **rest: seen.append(given) or SystemExit())
    with pytest.raises(SystemExit):  # there is nothing to save
        script("projection", run, tmp_path, {"projection": {}, "protocol": protocol})
    train = sorted(sides(run.rows, protocol)[0])
    assert which(seen[0][0], run.conditions.text) == which(seen[0][1], run.conditions.image) == train


@pytest.mark.parametrize("protocol", ["parity", "everything"])
def test_requests_are_learnt_from_training_materials(run, protocol, monkeypatch):
    """The tuned model, and what its checkpoint carries to answer requests by."""
    fitted = []
    same = SimpleNamespace(text=lambda rows: rows, image=lambda rows: rows, state={}, encoder="")
    everything = pd.DataFrame(np.eye(len(run.rows)) > 0)
    monkeypatch.setattr(training, "read_projection", lambda path: same)
    monkeypatch.setattr(training, "read_table", lambda path: None)
    monkeypatch.setattr(training, "categorise", lambda statistics, rules: everything)
    monkeypatch.setattr(training, "rendered_appearance", lambda weights: weights)
    monkeypatch.setattr(training, "encoder_of", lambda name: None)
    monkeypatch.setattr(training, "encoded_descriptions", lambda encoder: torch.zeros(1, 1))
    regression = SimpleNamespace(fit=lambda images, seen: SimpleNamespace(state={"images": images, "seen": seen}))
    monkeypatch.setattr(training, "AppearanceRegression", regression)
    monkeypatch.setattr(HyperDiffusion, "load", lambda path: SimpleNamespace())
    monkeypatch.setattr(
        ConditionalDiffusion, "fit", lambda self, weights, given, *rest: fitted.append((self, weights, given))
    )
    paths = {**run.paths, "projection": "", "statistics": "", "model": ""}
    training.tune(paths, protocol, {}, {}, {"sampler": "heun", "nfe": 8}, {}, 0, None, None)
    (model, weights, given), train = fitted[0], sorted(sides(run.rows, protocol)[0])
    c = run.conditions
    for found, table in (
        (weights, run.weights),
        (given["category"], torch.eye(len(run.rows))),
        (given["text"], c.text),
        (given["image"], c.image),
        (reorder(model.extra["fields"][model.extra["positions"]], model.extra["orders"].long()), run.weights),
        (model.extra["appearance.images"], c.image),
        (model.extra["appearance.seen"], run.weights),
    ):
        assert which(found, table) == train
    known = (c.type[train] > 0).any(0)
    assert torch.equal(given["type"], c.type[train][:, known])
    assert model.notes["types"] == [name for name, there in zip(c.types, known, strict=True) if there]
    captions = torch.nn.functional.normalize(c.text.flatten(0, 1))  # two of each material
    kept = torch.nn.functional.normalize(model.extra["captions"].float()) @ captions.T
    assert kept.amax(1).min() > 0.999 and set((kept.argmax(1) // 2).tolist()) <= set(train)


def test_stability_measures_novelty_against_training_materials(run, monkeypatch, tmp_path):
    seen = []
    monkeypatch.setattr(Synthesiser, "load", lambda path: None)
    monkeypatch.setattr(
        "neumat.stability.requests.stability_table", lambda bench, progress: seen.append(bench) or pd.DataFrame()
    )
    script("stability_conditional", run, tmp_path, {"guidance": {}}, model="")
    bench = seen[0]
    found = which(bench.training.brdf, evaluate(run.weights, *grid_angles(bench.entries)))
    assert found == sorted(sides(run.rows, training.PROTOCOL)[0])


@pytest.fixture
def bench(run):
    """The Bench of requests that is reported on."""
    return bench_of(run, "report")


def bench_of(run, side):
    """Return the Bench of requests of a side; its synthesiser embeds at random, the same every time."""
    rows = torch.from_numpy(np.random.default_rng(1).normal(size=(500, 8))).float()
    one_hot = torch.eye(len(run.conditions.types))
    synthesiser = SimpleNamespace(
        types=run.conditions.types,
        encode=lambda type: {"type": one_hot[[run.conditions.types.index(type)]]},
        read_texts=lambda texts, force: {"text": rows[: len(texts)]},
        seen=lambda weights, asked: Seen(*torch.zeros(2, len(weights), 1)),
        fit=lambda seen, asked: rows[: len(asked["text"]), :1] * torch.arange(seen.positions.shape[1]),
        alike=lambda features, rendered: features[:, :1].expand(-1, len(rendered)).argsort(1),
        recoloured=lambda weights, asked: weights,
        best=lambda weights, asked, n: weights[:, :n],
        embed=lambda encoded: encoded,
        encoder=SimpleNamespace(encode_image=lambda pictures: rows[: len(pictures)]),
        projection=SimpleNamespace(image=lambda features: features),
    )
    entries = torch.nonzero(above_horizon())[::1000, 0].numpy()
    return request_bench.Bench(side, run.paths, synthesiser, entries, 6, None, 0)


@pytest.mark.parametrize("side", ["validation", "report"])
def test_requests_show_held_out_materials_and_nulls_answer_with_training_materials(run, side):
    bench, (train, reference) = bench_of(run, side), sides(run.rows, training.PROTOCOL)
    assert which(bench.training.brdf, evaluate(run.weights, *grid_angles(bench.entries))) == sorted(train)
    for requests in bench.requests():
        for method, weights in bench.looked_up(requests, 3, 2).items():
            if (requests.modality, method) != ("type", request_bench.RECOLOURED):
                assert set(which(weights, run.weights)) <= train
        answers, _ = bench.of_training(requests, 3)
        assert not len(answers) or set(which(answers, run.weights)) <= train
        if requests.modality == "image":
            assert set(which(requests.targets, run.weights)) <= reference


def test_settings_are_chosen_on_other_pictures_and_prompts_than_are_reported_on(run):
    asked = [bench_of(run, side).requests() for side in ("validation", "report")]
    bases = [
        set(run.rows["base"][which(r.targets, run.weights)]) for side in asked for r in side if r.modality == "image"
    ]
    texts = [{name for r in side if r.modality == "text" for name in r.names} for side in asked]
    for one, other in (bases, texts):
        assert one and other and not one & other


def test_the_novelty_of_answers_is_measured_against_training_materials(run, bench):
    kind = bench.requests()[0]
    for side, near in zip(sides(run.rows, training.PROTOCOL), (True, False), strict=True):
        weights = run.weights[sorted(side)]
        result = bench.judge(kind, weights, np.arange(len(weights)) % len(kind))
        assert (result["nearest training"][0] < 1e-5) == near


def test_judges_have_not_seen_the_source_nearest_to_what_they_judge(run, bench):
    """Sources themselves and, by their texts, permutations of them are judged. Two sources of a type have nothing in
    common, and no two share a word: a judge that has seen a source knows it, and another one cannot."""
    plain, requests = np.arange(len(LETTERS)) * len(PERMUTATIONS), bench.requests()
    kinds, texts = (next(r for r in requests if (r.modality, r.use) == (name, "report")) for name in ("type", "text"))
    types, sources = bench.source_types, run.weights[plain]
    own = np.array([kinds.names.index(name) for name in types])
    judged = bench.judge(kinds, sources, own)
    alone = [
        TypeScorer().fit(run.weights[np.delete(plain, i)], np.delete(types, i)).predict(sources[[i]])[0] == types[i]
        for i in range(len(sources))
    ]
    assert judged["type right"][0] > 0.75
    assert judged["type right, judge has not seen it"][0] == pytest.approx(np.mean(alone)) and np.mean(alone) < 0.5
    for permutation in (0, 3):
        weights = run.weights[plain + permutation]
        seen = bench.texts.scores(weights, texts.names)
        assert (seen.argmax(1) == np.arange(len(LETTERS))).mean() > 0.75
        # The judge that has not seen it does not even know its word.
        assert (np.diag(bench.texts.scores(weights, texts.names, unseen=True)) == 0).all()
        assert bench.judge(texts, weights, np.arange(len(LETTERS)))["rank of the prompt"][0] > 3


def test_a_copy_is_a_training_material_and_no_stage_calls_it_new(run):
    """The chain from end to end: what is trained, sampled, and scored."""
    protocol = protocol_of(run, "parity")
    stores = [run.paths[key] for key in ("neumerl", "manifest", "sources")]
    copies = Copies().fit(training_dataset(*stores, "parity", 10, Copies), 0).sample(40, 0)
    assert set(which(copies, run.weights)) <= sides(run.rows, "parity")[0]
    training_set = protocol.materials(protocol.train, pictures=False)
    value, _ = nearest_training(protocol.fields(torch.from_numpy(copies), False), training_set, "brdf_l1_log")
    assert value.max() < 1e-5
