"""How well a material fits a text, by a scorer that shares nothing with the encoders of the conditional model.

A text is a bag of words (TF-IDF); kernel ridge regression predicts it from statistics and colour of the BRDF; the
score is the cosine between prediction and prompt.
"""

import re

import numpy as np
import pandas as pd
from sklearn.feature_extraction.text import TfidfVectorizer
from sklearn.kernel_ridge import KernelRidge
from sklearn.metrics import euclidean_distances
from sklearn.model_selection import GroupKFold
from sklearn.preprocessing import StandardScaler

from neumat.metrics.appearance import appearance
from neumat.metrics.statistics import statistics
from neumat.metrics.words import GLOSS_SYNONYMS, SYNONYMS, colour_name, gloss_name

FOLDS = 10
# The best of six pairs by cross-validation on the 100 sources, all of which are near.
PENALTY = 0.3
GAMMA = 0.3  # of the Gaussian kernel; statistics and colour have a total variance of 1 each

# What everyday words imply, in the words of the descriptions and of `neumat.metrics.words`: a prompt's "copper" is a
# metal, even if no source is of copper.
IMPLYING = {
    "metal": "copper iron zinc titanium platinum coin bar spoon knife blade alloy bronze metallic gold silver steel",
    "fabric": "cloth silk velvet cotton wool linen leather felt textile woven curtain sofa carpet",
    "wood": "timber plank table oak pine walnut maple cherry mahogany bamboo varnished",
    "plastic": "acrylic nylon toy vinyl polymer resin phenolic pvc",
    "rubber": "latex tyre tire vulcanised vulcanized neoprene eraser",
    "paint": "lacquer enamel varnish polish car coating",
    "stone": "marble granite rock pebble slate asphalt concrete obsidian",
    "ceramic": "porcelain china tile pottery cup",
    "glossy": "polished wet specular varnished lacquer porcelain sparkling",
    "matte": "flat paper chalk rough felt velvet",
    "satin": "sheen silk",
}
REPLACED = SYNONYMS | GLOSS_SYNONYMS


def words(text):
    """Return the words of a text in lower case, synonyms replaced, each followed by what it implies (IMPLYING)."""
    found = []
    for word in re.findall(r"[a-z]+", text.lower()):
        word = REPLACED.get(word, word)
        found += [word, *(implied for implied, implying in IMPLYING.items() if word in implying.split())]
    return found


def material_texts(weights, descriptions):
    """Return a text for each of the fields (n, 675): gloss and colour as measured on it, then its description."""
    seen = appearance(weights)
    parts = zip(gloss_name(seen), colour_name(seen), descriptions, strict=True)
    return [" ".join(part) for part in parts]


class TextScorer:
    """Scores of materials for texts; see the module.

    As with TypeScorer, `unseen` scores are by a model that has not seen the source nearest to a material, nor that
    source's permutations: only they compare with the cross-validated ceiling. FOLDS such models serve for all.
    """

    def fit(self, weights, texts, sources):
        """Fit to fields (n, 675), their texts (n,), such as `material_texts` returns, and sources (n,): a material and
        its permutations have the same one. Return self."""
        features = _features(weights)
        self.scaler = StandardScaler().fit(features)
        self.x, self.texts = _balanced(self.scaler.transform(features)), np.asarray(texts)
        self.fold = np.empty(len(self.x), int)
        for k, (_, test) in enumerate(GroupKFold(min(FOLDS, len(set(sources)))).split(self.x, groups=sources)):
            self.fold[test] = k
        self.all = _Model(self.x, self.texts)
        self.without = {}  # fold -> the model that has never seen it, made when it is wanted
        return self

    def scores(self, weights, prompts, unseen=False):
        """Return the scores (n, len(prompts)), cosines, of fields (n, 675). A prompt without a known word gets 0."""
        x = _balanced(self.scaler.transform(_features(weights)))
        if not unseen:
            return self.all.scores(x, prompts)
        of_kind = slice(None, -len(_COLOUR))  # what the permutations of a source share
        folds = self.fold[euclidean_distances(x[:, of_kind], self.x[:, of_kind]).argmin(1)]
        found = np.empty((len(x), len(prompts)))
        for fold in np.unique(folds):
            if fold not in self.without:
                self.without[fold] = _Model(self.x[self.fold != fold], self.texts[self.fold != fold])
            found[folds == fold] = self.without[fold].scores(x[folds == fold], prompts)
        return found


class _Model:
    """Kernel ridge regression from features (n, d) to the TF-IDF of texts (n,)."""

    def __init__(self, x, texts):
        self.vectors = TfidfVectorizer(analyzer=words, sublinear_tf=True)
        target = self.vectors.fit_transform(texts).toarray()
        # Predicted is how a text differs from the mean one: words that all materials share shouldn't count.
        self.ridge = KernelRidge(alpha=PENALTY, kernel="rbf", gamma=GAMMA).fit(x, target - target.mean(0))

    def scores(self, x, prompts):
        predicted = self.ridge.predict(x)
        predicted /= np.maximum(np.linalg.norm(predicted, axis=1, keepdims=True), 1e-12)
        return predicted @ self.vectors.transform(prompts).toarray().T


_COLOUR = ("lightness", "a", "b", "metallic")


def _features(weights):
    seen = appearance(weights)
    hue = np.radians(seen["hue"])
    seen = seen.assign(a=seen["chroma"] * np.cos(hue), b=seen["chroma"] * np.sin(hue))
    return np.concatenate([statistics(weights), seen[list(_COLOUR)].to_numpy(float)], 1)


def _balanced(x):
    """Return standardised features (n, d), statistics and colour each scaled to a total variance of 1."""
    colour = len(_COLOUR)
    return np.concatenate([x[:, :-colour] / (x.shape[1] - colour) ** 0.5, x[:, -colour:] / colour**0.5], 1)


def retrieval_rank(scores, own):
    """Return the rank (n,), from 1, of each material's own prompt, column `own` (n,), among all prompts of `scores`
    (n, prompts). Prompts of the same score share the mean of their ranks."""
    true = np.take_along_axis(scores, np.asarray(own)[:, None], 1)
    return (scores > true).sum(1) + ((scores == true).sum(1) + 1) / 2


def cross_validate(weights, texts, sources):
    """Return a DataFrame with a row for each material: text, rank of its text among all different ones, and their
    number; each judged by a model fitted to other sources.

    weights (n, 675), texts (n,), sources (n,): see TextScorer.
    """
    prompts = sorted(set(texts))
    own = [prompts.index(text) for text in texts]
    scores = TextScorer().fit(weights, texts, sources).scores(weights, prompts, unseen=True)
    return pd.DataFrame({"text": texts, "rank": retrieval_rank(scores, own), "prompts": len(prompts)})
