"""Which prompts and materials each side sees: settings are chosen on one, tables report the other."""

import functools
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch.nn.functional import pad

from neumat.augment.manifest import draw_manifest, protocol_indices
from neumat.brdf.types import read_types, type_names, type_rows
from neumat.conditions.choice import Seen
from neumat.conditions.prompts import EARLIER, REPORT, VALIDATION
from neumat.conditions.store import Conditions, write_conditions
from neumat.conditions.training import PROTOCOL
from neumat.errors import NeumatError
from neumat.fields.layout import permute_channels
from neumat.fields.store import PER_MATERIAL, write_neumerl
from neumat.studies import request_bench, requests
from neumat.studies.request_bench import LOOK_UP, RECOLOURED, SIDES, Bench, shown_materials
from neumat.studies.request_sweeps import guidance_sweep, text_row

CONFIG = Path(__file__).parents[3] / "config"
IMAGES = 2


@given(st.data())
def test_no_base_material_is_on_both_sides(data):
    bases = np.array(data.draw(st.lists(st.sampled_from("abcdefgh"), min_size=2, max_size=40)))
    reference = np.array(data.draw(st.sets(st.integers(0, len(bases) - 1), min_size=1).map(sorted)))
    images, seed = data.draw(st.integers(1, 10)), data.draw(st.integers(0, 20))
    several = len(set(bases[reference]))
    if several < 2:
        with pytest.raises(NeumatError, match="at least two bases"):
            shown_materials(bases, reference, images, seed)
        return
    sides = shown_materials(bases, reference, images, seed)
    assert set(sides) == {VALIDATION, REPORT}
    for shown in sides.values():
        assert 1 <= len(shown) <= images and len(set(shown)) == len(shown) and set(shown) <= set(reference)
    assert not set(bases[sides[VALIDATION]]) & set(bases[sides[REPORT]])
    again = shown_materials(bases, reference, images, seed)
    assert all((again[side] == sides[side]).all() for side in sides)


class Synthesiser:
    """Knows what it was asked for: `texts`, and how many `pictures`. Its answers are its training materials."""

    def __init__(self, toy, types, weights):
        self.types, self.weights, self.toy, self.texts, self.pictures = types, weights, toy(), [], []
        self.model, self.encoder = self, self
        self.projection = SimpleNamespace(image=self.common)

    def encode(self, type):
        return {"type": torch.eye(len(self.types))[self.types.index(type)][None]}

    def read_texts(self, texts, force):
        assert force
        self.texts += texts
        return {"text": self.toy.encode_text(texts)}

    def encode_image(self, pictures):
        self.pictures += list(pictures)
        return self.toy.encode_image(pictures)

    def common(self, features):
        """Return encoded texts or images (..., size) in a common space."""
        return pad(features, (0, self.toy.WORDS - features.shape[-1]))

    def embed(self, encoded):
        return {name: rows if name == "type" else self.common(rows) for name, rows in encoded.items()}

    def draw(self, n, *_):
        return self.weights[torch.arange(n) % len(self.weights)]

    def sample(self, n, *_):
        return self.draw(n), n

    def alike(self, features, rendered):
        return torch.arange(len(rendered)).expand(len(features), -1)

    def seen(self, weights, asked):
        return Seen(*torch.zeros(2, len(weights), 1))

    def fit(self, seen, asked):
        return torch.zeros(len(asked["text"]), seen.positions.shape[1])

    def recoloured(self, weights, asked):
        return weights

    def best(self, weights, asked, n):
        return weights[:, :n]


@pytest.fixture(scope="module")
def stores(tmp_path_factory, field, toy):
    """A function: side -> a Bench of it on eight toy sources and four blends, and its Synthesiser."""
    folder = tmp_path_factory.mktemp("bench")
    types = read_types(CONFIG / "types.tsv").iloc[:16:2]
    rows = draw_manifest(list(types.index), {"blends": 4, "held_out": 0.25, "weight_range": [0.3, 0.7]}, 0)
    generator = np.random.default_rng(0)
    bases = [field(generator.uniform(0.02, 0.5, 3), generator.uniform(0, 50)) for _ in range(12)]
    weights = torch.stack([permute_channels(bases[i // 6], rows["permutation"][i]) for i in range(len(rows))])
    write_neumerl(folder / "neumerl.h5", rows, weights, dict.fromkeys(PER_MATERIAL, np.ones(len(rows))), {})
    rows.to_csv(folder / "manifest.tsv", sep="\t", index=False)
    facts = pd.DataFrame({"name": rows["name"], "colour": "red", "gloss": "matte", "thing": "", "family": ""})
    known = torch.from_numpy(type_rows(rows, types))
    nothing = torch.rand(len(rows), 1, 48)
    write_conditions(
        folder / "conditions.h5",
        Conditions("toy", type_names(rows, types), known, facts, [["a"]] * len(rows), nothing, nothing),
    )
    paths = {name: folder / f"{name}.h5" for name in ("neumerl", "conditions")} | {"manifest": folder / "manifest.tsv"}
    paths |= {name: CONFIG / f"{name}.tsv" for name in ("types", "prompts")}
    train, _ = protocol_indices(rows, PROTOCOL)

    @functools.cache
    def make(side):
        asked = Synthesiser(toy, type_names(rows, types), weights[train])
        return Bench(side, paths, asked, np.arange(0, 1_000_000, 50_000), IMAGES, None, 0), asked

    return make


@pytest.fixture(scope="module")
def prompts():
    table = pd.read_csv(CONFIG / "prompts.tsv", sep="\t")
    return {use: set(group) for use, group in table.groupby("use")["prompt"]}


@pytest.fixture(autouse=True)
def small(monkeypatch):
    for name, value in {"PICTURE_SIZE": 16, "SPHERE": (24, 4, 8), "NOVELTY_ENTRIES": 16}.items():
        monkeypatch.setattr(request_bench, name, value)


def test_sweeps_that_choose_settings_see_the_prompts_and_materials_for_validation_only(stores, prompts):
    bench, asked = stores(VALIDATION)
    rows = [guidance_sweep(bench, 2, [0.0], 0), pd.DataFrame([text_row(bench, 2, 0.0, 0)])]
    assert all((table["use"] == VALIDATION).all() for table in rows)
    assert set(asked.texts) == prompts[VALIDATION]
    assert len(asked.pictures) == 2 * IMAGES  # once for each sweep
    own, others = (
        {name.split("@")[0] for name in bench.conditions.facts["name"][stores(side)[0].shown]} for side in SIDES
    )
    shown = {name.split("@")[0] for r in bench.requests() if r.modality == "image" for name in r.names}
    assert shown == own and not own & others


def test_tables_report_the_other_prompts_and_materials_and_say_which_were_used_before(stores, prompts):
    bench, asked = stores(REPORT)
    table, types, samples = requests.compare(bench, 2, 0.0, 1, 0)
    assert set(asked.texts) == prompts[EARLIER] | prompts[REPORT]
    assert {(r.modality, r.use): len(r) for r, _ in samples} == {
        ("type", REPORT): len(asked.types),
        ("text", EARLIER): 36,
        ("text", REPORT): len(prompts[REPORT]),
        ("image", REPORT): IMAGES,
    }
    assert {use: set(r.names) for r, _ in samples for use in [r.use] if r.modality == "text"} == {
        use: prompts[use] for use in (EARLIER, REPORT)
    }
    assert set(zip(table["modality"], table["use"], strict=True)) == {(r.modality, r.use) for r, _ in samples}
    looked_up = table[table["method"].isin([LOOK_UP, RECOLOURED])].groupby("method")["modality"].unique()
    assert all(set(modalities) == {"type", "text", "image"} for modalities in looked_up) and len(looked_up) == 2
    both = table[table["measure"] == requests.BOTH]
    assert (both["low"] <= both["value"]).all() and (both["value"] <= both["high"]).all()
    assert types["type"].tolist()[-1] == "all types" and len(types) == len(asked.types) + 1


def test_an_answer_is_ranked_under_its_own_prompt_among_all_of_the_side(stores, monkeypatch):
    bench, _ = stores(REPORT)
    later = next(r for r in bench.requests() if (r.modality, r.use) == ("text", REPORT))
    names = list(bench.prompts.index)
    best = [names.index(later.names[i]) for i in (2, 0)]

    def scores(weights, prompts, unseen):
        assert list(prompts) == names and unseen
        return np.eye(len(names))[best]

    monkeypatch.setattr(bench.texts, "scores", scores)
    found = bench.judge(later, bench.weights[:2], np.array([2, 0]))
    assert found["rank of the prompt"][0] == 1 and found["prompt among 3"][0] == 1
