import importlib.util

import pytest
import torch

from neumat.conditions.minilm import PACKAGE, minilm
from neumat.errors import NeumatError

TEXTS = [
    "red plastic",
    "A mirror-like, highly polished metal with a purple tint",
    "café \U0001f534 naïve",
    "rust " * 400,
]


def test_texts_and_their_pieces_are_those_of_the_package_that_trained_it():
    """The independent witness: sentence_transformers, on the same weights."""
    witness = pytest.importorskip("sentence_transformers", reason="sentence_transformers is not installed")
    folder = str(importlib.util.find_spec(PACKAGE).submodule_search_locations[0]) + "/model"
    theirs = witness.SentenceTransformer(folder, device="cpu", local_files_only=True)
    expected = theirs.encode(TEXTS, convert_to_tensor=True, show_progress_bar=False)
    assert (minilm().encode(TEXTS) - expected).abs().max() < 1e-5
    tokenise = theirs.tokenizer
    assert minilm().longest == theirs.max_seq_length - 2
    for text in TEXTS:
        found = tokenise(text, add_special_tokens=False, return_offsets_mapping=True, verbose=False)
        known = [number != tokenise.unk_token_id for number in found["input_ids"]]
        assert minilm().pieces(text) == [(*span, k) for span, k in zip(found["offset_mapping"], known, strict=True)]


def test_a_text_is_encoded_alike_alone_and_among_others():
    texts = [*TEXTS, *TEXTS[:3] * 30]  # of several batches
    together = minilm().encode(texts)
    alone = {text: minilm().encode([text])[0] for text in TEXTS}
    assert torch.allclose(together, torch.stack([alone[text] for text in texts]), atol=1e-5)


def test_what_is_beyond_the_limit_changes_nothing():
    longest = minilm().longest
    a, b = (minilm().encode([f"{'rust ' * longest}{rest}"]) for rest in ("", "and a blue ball"))
    assert torch.equal(a, b)


def test_a_missing_package_ends_in_one_line(monkeypatch):
    monkeypatch.setattr("neumat.conditions.minilm.PACKAGE", "no_such_encoder")
    minilm.cache_clear()
    with pytest.raises(NeumatError, match="no-such-encoder; found none"):
        minilm()
