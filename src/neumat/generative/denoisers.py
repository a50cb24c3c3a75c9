"""Networks that a Denoiser wraps: network(x (n, k), c (n,)) -> (n, k), c a function of the noise level.

A conditional model adds the embedded request, `condition` (n, LEVEL_WIDTH), to the embedded level.
"""

import math

import torch
from torch import nn

from neumat.errors import NeumatError
from neumat.fields.layout import SIZE, matrices

LEVEL_WIDTH = 128  # of the embedded noise level: wider costs as much as the network itself
OCTAVES = 8


class LevelEmbedding(nn.Module):
    """Noise level (n,) -> (n, LEVEL_WIDTH): sines and cosines at octaves, then two linear layers."""

    def __init__(self):
        super().__init__()
        self.register_buffer("frequencies", 2.0 ** torch.arange(-2, OCTAVES - 2), persistent=False)
        self.net = nn.Sequential(
            nn.Linear(2 * OCTAVES, LEVEL_WIDTH), nn.SiLU(), nn.Linear(LEVEL_WIDTH, LEVEL_WIDTH), nn.SiLU()
        )

    def forward(self, c):
        phase = c[:, None] * self.frequencies
        return self.net(torch.cat([phase.sin(), phase.cos()], -1))


class Modulated(nn.Module):
    """A residual branch behind a layer norm whose scale and shift, and the branch's gate, follow the noise level.

    The gate starts at zero, so that every block starts as the identity (Peebles & Xie 2023, adaLN-Zero).
    """

    def __init__(self, width, branch):
        super().__init__()
        self.norm = nn.LayerNorm(width, elementwise_affine=False)
        self.modulation = nn.Linear(LEVEL_WIDTH, 3 * width)
        nn.init.zeros_(self.modulation.weight)
        nn.init.zeros_(self.modulation.bias)
        self.branch = branch

    def forward(self, x, level):
        shift, scale, gate = self.modulation(level).chunk(3, -1)
        return x + gate * self.branch(self.norm(x) * (1 + scale) + shift)


def feed_forward(width, expansion, dropout):
    """Return the two-layer branch width -> expansion * width -> width."""
    return nn.Sequential(
        nn.Linear(width, expansion * width), nn.SiLU(), nn.Dropout(dropout), nn.Linear(expansion * width, width)
    )


class ResidualMLP(nn.Module):
    """The whole vector as one token: `depth` modulated feed-forward blocks."""

    def __init__(self, size, width=512, depth=4, expansion=2, dropout=0.0):
        super().__init__()
        self.level = LevelEmbedding()
        self.enter = nn.Linear(size, width)
        self.blocks = nn.ModuleList(Modulated(width, feed_forward(width, expansion, dropout)) for _ in range(depth))
        self.leave = nn.Linear(width, size)
        nn.init.zeros_(self.leave.weight)
        nn.init.zeros_(self.leave.bias)

    def forward(self, x, c, condition=0):
        level = self.level(c) + condition
        hidden = self.enter(x)
        for block in self.blocks:
            hidden = block(hidden, level)
        return self.leave(hidden)


class SelfAttention(nn.Module):
    """Multi-head self-attention over (n, tokens, width)."""

    def __init__(self, width, heads):
        super().__init__()
        self.heads = heads
        self.qkv = nn.Linear(width, 3 * width)
        self.out = nn.Linear(width, width)

    def forward(self, x):
        q, k, v = self.qkv(x).unflatten(-1, (3, self.heads, -1)).permute(2, 0, 3, 1, 4)
        return self.out(nn.functional.scaled_dot_product_attention(q, k, v).transpose(1, 2).flatten(-2))


def token_groups(size, tokens):
    """Return the index tensors of the tokens of a vector of `size` numbers.

    tokens: "layer" (kernel and bias of each layer of the field) or "neuron" (incoming weights and bias of each
    neuron), for unrotated weights only; or the length of a chunk, for any vector. Raises NeumatError otherwise.
    """
    if isinstance(tokens, int) and tokens > 0:
        return list(torch.arange(size).split(tokens))
    if tokens not in ("layer", "neuron") or size != SIZE:
        raise NeumatError("tokens", f"a chunk length, or layer or neuron for {SIZE} unrotated weights", (tokens, size))
    layers = matrices(torch.arange(SIZE))
    if tokens == "layer":
        return [matrix.flatten() for matrix in layers]
    return [column for matrix in layers for column in matrix.T]


class TokenTransformer(nn.Module):
    """Transformer over the tokens of the weight vector, each with its own linear embedding in and out."""

    def __init__(self, size, tokens="layer", width=192, depth=4, heads=4, expansion=4, dropout=0.0):
        super().__init__()
        if width % heads:
            raise NeumatError("width", f"a multiple of heads = {heads}", width)
        groups = token_groups(size, tokens)
        longest = max(map(len, groups))
        # Short tokens are padded with the index of a zero that is appended to the vector.
        index = torch.stack([nn.functional.pad(g, (0, longest - len(g)), value=size) for g in groups])
        self.register_buffer("index", index, persistent=False)
        self.register_buffer("order", torch.argsort(index.flatten(), stable=True)[:size], persistent=False)
        self.level = LevelEmbedding()
        self.enter = nn.Parameter(torch.randn(len(groups), longest, width) / math.sqrt(longest))
        self.position = nn.Parameter(torch.randn(len(groups), width) * 0.02)
        self.attention = nn.ModuleList(Modulated(width, SelfAttention(width, heads)) for _ in range(depth))
        self.mlp = nn.ModuleList(Modulated(width, feed_forward(width, expansion, dropout)) for _ in range(depth))
        self.norm = nn.LayerNorm(width)
        self.leave = nn.Parameter(torch.zeros(len(groups), width, longest))

    def forward(self, x, c, condition=0):
        level = (self.level(c) + condition)[:, None]
        tokens = nn.functional.pad(x, (0, 1))[:, self.index]
        hidden = torch.einsum("btl,tlw->btw", tokens, self.enter) + self.position
        for attention, mlp in zip(self.attention, self.mlp, strict=True):
            hidden = mlp(attention(hidden, level), level)
        return torch.einsum("btw,twl->btl", self.norm(hidden), self.leave).flatten(1)[:, self.order]


DENOISERS = {"mlp": ResidualMLP, "transformer": TokenTransformer}
