"""What is asked of samples on demand, and who judges how well they follow.

No judge here shares anything with the encoders or the generative model (`metrics.appearance`, `type_scorer`,
`text_scorer`, `alignment`). Captions, and what candidates are recoloured to and told by, take their words for colour
and gloss from where the judge does: colour and gloss of "best of k" and of look-ups show what is served, those without
what the model knows.
Requests are the types, the unseen prompts, and pictures of held-out materials. Prompts and pictures have two sides:
settings are chosen on `validation`, tables report the other. Types are a closed list, so a sweep asks for the same ones
and draws by another seed.
"""

import functools
from dataclasses import dataclass

import numpy as np
import pandas as pd
import torch

from neumat.augment.manifest import protocol_indices, read_manifest
from neumat.augment.permutations import PERMUTATIONS
from neumat.brdf.coordinates import grid_angles
from neumat.brdf.types import read_types
from neumat.conditions.photos import SPHERE, augmented, lighting
from neumat.conditions.prompts import EARLIER, REPORT, VALIDATION, read_prompts
from neumat.conditions.store import read_conditions
from neumat.conditions.texts import thing_of
from neumat.conditions.training import PROTOCOL
from neumat.errors import NeumatError
from neumat.fields.field import evaluate
from neumat.fields.store import read_neumerl
from neumat.metrics.alignment import diversity, new_environment, rendered_distance
from neumat.metrics.appearance import appearance
from neumat.metrics.materials import MaterialSet, metric_entries
from neumat.metrics.novelty import NOVELTY_ENTRIES, nearest_training
from neumat.metrics.words import colour_right, gloss_right, prompt_met, says
from neumat.render.scene import to_srgb8
from neumat.render.sphere import FrozenSphere, radiance_fields
from neumat.seeds import numpy_generator
from neumat.studies.look_up import LookUp, dense_materials, in_colours_of
from neumat.studies.measured_requests import measured_pictures
from neumat.studies.text_scorer import TextScorer, material_texts, retrieval_rank
from neumat.studies.type_scorer import TypeScorer, accuracies

PICTURE_SIZE = 96  # pixels of the pictures under new lighting
DISTANCE = "brdf_l1_log"
UNSEEN = 50  # number of a lighting that no training picture has
SEVERAL = 2  # sources of a type, from which a judge that has not seen the nearest one can know the type
MET = 0.35  # share of the answers that are right, below which a type counts as not met
LOOK_UP, RECOLOURED, DENSE = "look-up: training", "look-up: recoloured training", "look-up: dense"
SIDES = {VALIDATION: (VALIDATION,), REPORT: (EARLIER, REPORT)}  # side -> uses of its prompts


@dataclass(frozen=True)
class Requests:
    """What is asked of a method: `modality`; `use`, one of `conditions.prompts.USES`; `names` (r,) of the requests;
    `encoded` {the modality as the model knows it: rows (r, size)}, see `Synthesiser.encode`, and `embedded`, the same
    as the model takes them; for images `targets`, the fields shown (r, 675) or their pictures under the judge's light,
    and `shown` (r, H, W, 3) uint8, what was asked with."""

    modality: str
    use: str
    names: list
    encoded: dict
    embedded: dict
    targets: torch.Tensor | None = None
    shown: torch.Tensor | None = None

    def __len__(self):
        return len(self.names)

    def each(self, n):
        """Return {modality: (r n, size)}: every request n times in a row, as the model takes them."""
        return {name: rows.repeat_interleave(n, 0) for name, rows in self.embedded.items()}


class Bench:
    """The requests and the judges of one evaluation. paths: neumerl, manifest, sources, types, prompts, conditions
    and, where there is a dense set, dense.

    side: validation, on which settings are chosen, or report. synthesiser: its encoders and projection make the
    requests. entries: of the valid MERL entries. images: how many held-out materials are shown. measured: paths of RGL
    files that are shown too, or None.
    """

    def __init__(self, side, paths, synthesiser, entries, images, measured, seed):
        self.side, self.seed, self.synthesiser, self.measured = side, seed, synthesiser, measured
        rows, self.table = read_manifest(paths["manifest"]), read_types(paths["types"])
        self.weights = read_neumerl(paths["neumerl"]).weights
        self.conditions = read_conditions(paths["conditions"])
        self.train, self.reference = protocol_indices(rows, PROTOCOL)
        source = rows["parent_a"] == rows["parent_b"]
        self.families = dict(zip(self.table["type"], self.table["family"], strict=True))

        plain = rows[source & rows["base"].isin(self.table.index) & (rows["permutation"] == PERMUTATIONS[0])]
        self.source_types = self.table["type"][plain["base"]].to_numpy()
        # Of the user's own materials no type is known: none is asked for then, nor can be judged.
        if len(set(self.source_types)) > 1:
            self.types = TypeScorer().fit(self.weights[plain.index], self.source_types)
        names, counts = np.unique(self.source_types, return_counts=True)
        self.several = names[counts >= SEVERAL]
        own = rows[source]
        described = [thing_of(row, self.table)[0] for row in own.itertuples()]
        self.texts = TextScorer().fit(
            self.weights[own.index], material_texts(self.weights[own.index], described), own["base"].to_numpy()
        )
        prompts = read_prompts(paths["prompts"], self.table["family"].unique()).set_index("prompt", drop=False)
        self.prompts = prompts[prompts["use"].isin(SIDES[side])]
        self.entries = metric_entries(entries, NOVELTY_ENTRIES, seed)
        self.training = self.materials(self.weights[self.train])
        self.sphere = FrozenSphere(PICTURE_SIZE, environment=new_environment)
        self.camera = FrozenSphere(*SPHERE, environment=lighting(UNSEEN))
        self.look_up = LookUp(synthesiser, self.weights[self.train])
        # In wanted colours all orders of a material's channels are alike.
        plain = self.train[(rows["permutation"] == PERMUTATIONS[0]).to_numpy()[self.train]]
        self.plain_look_up = LookUp(synthesiser, self.weights[plain])
        dense = dense_materials(paths["dense"], rows, PROTOCOL) if "dense" in paths else None
        self.dense_look_up = None if dense is None else LookUp(synthesiser, dense)
        self.shown = shown_materials(rows["base"].to_numpy(), self.reference, images, seed)[side]

    def materials(self, weights):
        """Return the MaterialSet of fields (n, 675), without pictures."""
        return MaterialSet(self.entries, evaluate(weights, *grid_angles(self.entries)))

    def requests(self):
        """Return the Requests of each modality: types, where two or more are known, prompts, pictures."""
        known = self.synthesiser.types
        shown = self.weights[self.shown]
        taken = augmented(radiance_fields(self.camera, shown), self.seed, "shown")
        names = [self.conditions.facts["name"][i] for i in self.shown]
        result = [
            *self._texts_asked(),
            self._pictured("image", names, taken, shown),
        ]
        if len(known) > 1:
            rows = torch.cat([self.synthesiser.encode(type=name)["type"] for name in known])
            result.insert(0, self._asked("type", known, {"type": rows}))
        if self.measured:
            names, linear, judged = measured_pictures(self.measured, self.camera, self.sphere)
            result.append(self._pictured("measured", names, augmented(linear, self.seed, "measured"), to_srgb8(judged)))
        return result

    def _texts_asked(self):
        """Return the Requests of the side's prompts, those of each use for themselves."""
        return [
            self._asked("text", list(names), self.synthesiser.read_texts(list(names), force=True), use=use)
            for use, names in self.prompts.groupby("use")["prompt"]
        ]

    def _asked(self, modality, names, encoded, use=None, **rest):
        return Requests(modality, use or self.side, names, encoded, self.synthesiser.embed(encoded), **rest)

    def _pictured(self, modality, names, taken, targets):
        encoded = {"image": self.synthesiser.encoder.encode_image(taken)}
        return self._asked(modality, names, encoded, targets=targets, shown=taken)

    def looked_up(self, requests, n, candidates):
        """Return {method: fields (r n, 675)}: what the score that serves requests finds among known materials, see
        `look_up`; `candidates`: of a model, for each answer.

        Among the training materials; among these in the wanted colours; and in the dense set, where there is one. For a
        type, the known ones of it at random, and the same in the colours of others.
        """
        if requests.modality == "type":
            members = np.concatenate([self._members(requests, i, n) for i in range(len(requests))])
            weights = self.weights[self.train[members]]
            others = numpy_generator(self.seed, "colours").integers(len(self.train), size=len(weights))
            made = in_colours_of(weights, self._training_appearance.iloc[others])
            return {LOOK_UP: weights, RECOLOURED: made}
        asked = requests.encoded
        found = {
            LOOK_UP: self.look_up.answers(asked, n, candidates),
            RECOLOURED: self.plain_look_up.recoloured(asked, n, candidates),
        }
        if self.dense_look_up:
            found[DENSE] = self.dense_look_up.answers(asked, n, candidates)
        return {method: weights.flatten(0, 1) for method, weights in found.items()}

    def of_training(self, requests, n):
        """Return (fields, the requests they belong to): training materials that are what is asked for, up to n each.

        Types: unblended ones of the type. Texts: those that fit all that can be measured of the prompt. Images: the one
        whose BRDF is nearest to the target's, the best that retrieval can do.
        """
        kept, belongs = [], []
        for i in range(len(requests)):
            chosen = self._members(requests, i)[:n]
            kept.append(self.train[chosen])
            belongs += [i] * len(chosen)
        return self.weights[np.concatenate(kept)], np.array(belongs)

    def _members(self, requests, i, n=0):
        """Return the positions of the training materials that are what request i asks for, in a random order; fewer
        than `n` round and round."""
        found = numpy_generator(self.seed, "members", requests.names[i]).permutation(self._fitting(requests, i))
        return np.resize(found, max(n, len(found)))[: n or None]

    def _fitting(self, requests, i):
        if requests.modality == "type":
            column = self.conditions.types.index(requests.names[i])
            return (self.conditions.type[self.train, column] == 1).nonzero()[:, 0].numpy()
        if requests.modality == "image":
            values = self.materials(requests.targets[i : i + 1])
            return nearest_training(values, self.training, DISTANCE)[1].numpy()
        if requests.modality == "measured":
            return np.array([], int)
        row = self.prompts.loc[requests.names[i]]
        seen = self._training_appearance
        return np.flatnonzero(prompt_met(seen, row)) if row["colour"] or row["gloss"] else np.array([], int)

    @functools.cached_property
    def _training_appearance(self):
        return appearance(self.weights[self.train])

    def both_right(self, requests, weights, belongs):
        """Return the share of the answers, a Series by request, of which all is true that can be measured of their
        prompt, colour and gloss; requests of which nothing can be measured are left out."""
        prompts, seen, shares = self.prompts.loc[requests.names], appearance(weights), {}
        for i in np.unique(belongs):
            if prompts["colour"].iloc[i] or prompts["gloss"].iloc[i]:
                shares[i] = prompt_met(seen[belongs == i], prompts.iloc[i]).mean()
        return pd.Series(shares, dtype=float)

    def judge(self, requests, weights, belongs):
        """Return {measure: (value, how many materials)} of fields (m, 675) that answer the requests `belongs` (m,)."""
        judges = {"type": self._types, "text": self._texts, "image": self._images, "measured": self._images}
        result = judges[requests.modality](requests, weights, belongs)
        materials = self.materials(weights)
        spread = pd.Series({i: diversity(materials[torch.from_numpy(belongs == i)]) for i in np.unique(belongs)})
        result["diversity"] = (spread.mean(), len(weights))
        if requests.modality == "type":
            several = spread.index[np.isin(np.array(requests.names)[spread.index], self.several)]
            judged = int(np.isin(belongs, several).sum())
            result["diversity, types of several sources"] = (spread[several].mean(), judged)
        distance, _ = nearest_training(materials, self.training, DISTANCE)
        result["nearest training"] = (distance.median().item(), len(weights))
        return result

    def by_type(self, requests, weights, belongs, unseen):
        """Return the table of `accuracies` of fields that answer requests for types."""
        return accuracies(self.types, weights, np.array(requests.names)[belongs], self.families, unseen)

    def _types(self, requests, weights, belongs):
        unseen, seen = (self.by_type(requests, weights, belongs, unseen) for unseen in (True, False))
        several = unseen["type"].isin(self.several)
        return {
            "type right, judge has not seen it": _mean(unseen[several], "top1"),
            "type among 3, judge has not seen it": _mean(unseen[several], "top3"),
            "family right, judge has not seen it": _mean(unseen, "family_accuracy"),
            "type right": _mean(seen, "top1"),
            f"types met by fewer than {MET:.0%}": (int((seen["top1"] < MET).sum()), len(seen)),
        }

    def _texts(self, requests, weights, belongs):
        own = self.prompts.index.get_indexer(requests.names)[belongs]
        rank = retrieval_rank(self.texts.scores(weights, self.prompts.index, unseen=True), own)
        result = {"rank of the prompt": (np.median(rank), len(rank)), "prompt among 3": (np.mean(rank <= 3), len(rank))}
        return result | self._words(self.prompts.loc[requests.names], weights, belongs)

    def _words(self, prompts, weights, belongs):
        """Return the share of fields of which is true what can be measured of their prompt; also of those prompts alone
        that say the word: others leave it to what one knows of walnut or asphalt."""
        seen, result = appearance(weights), {}
        for column, right in (("colour", colour_right), ("gloss", gloss_right)):
            expected = prompts[column].to_numpy()
            hits = {i: right(seen[belongs == i], expected[i]) for i in np.unique(belongs) if expected[i]}
            said = {i: hit for i, hit in hits.items() if says(prompts.index[i], expected[i])}
            for measure, found in ((f"{column} right", hits), (f"{column} right, where the prompt says it", said)):
                judged = np.concatenate([*found.values()] or [[]])
                result[measure] = (judged.mean() if len(judged) else np.nan, len(judged))
        return result

    def _images(self, requests, weights, belongs):
        rmse, _ = rendered_distance(self.sphere, weights, requests.targets[belongs])
        return {"RMSE under new light": (rmse.mean(), len(rmse))}


def shown_materials(bases, reference, images, seed):
    """Return {side: indices} of at most `images` of the held-out materials `reference` each, drawn by the seed; no base
    material is on both sides. bases: of every material.

    Raises NeumatError where all held-out materials are of one base.
    """
    order = numpy_generator(seed, "shown materials").permutation(reference)
    several = pd.unique(bases[order])
    if len(several) < 2:
        raise NeumatError("conditional", "held-out materials of at least two bases", ", ".join(several) or "none")
    validation = order[np.isin(bases[order], several[: min(images, len(several) // 2)])][:images]
    others = order[~np.isin(bases[order], bases[validation])]
    return {VALIDATION: validation, REPORT: others[:images]}


def _mean(table, column):
    count = int(table["judged"].sum())
    return ((table[column] * table["judged"]).sum() / count if count else np.nan, count)
