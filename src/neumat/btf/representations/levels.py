"""Levels of detail of a plane, trained beside it: a texel decodes to the mean of what the texels under it decode to.

The mean of their features does not, as the network is not linear: on captured leather, weave and metal, 64 x 64 texels,
the colour of the whole exemplar is off by 25 to 50 %. Features alone cannot mend that: with the network as it is, the
best are off by 16 to 50 %. So the network learns levels, too, in the second half of a fit: 8 to 21 %, for 14 % more
time. After 16 million samples the plane itself is as accurate as without; after 4 million it has lost 0.2 dB.
"""

import torch

from neumat.btf.planes import in_levels, means
from neumat.btf.representations.network import forward, gradients
from neumat.fields.optimisers import Adam

EVERY = 2  # sweeps between two steps of the levels, in the second half
BLOCK = 1 << 14  # texels decoded at a time


class Levels:
    """The levels of a plane of `size` (H, W), from 2 x 2 texels on: `texels` (c, n), None before the first step.

    encoding: the `Encoding` of the network's outputs.
    """

    def __init__(self, size, encoding):
        self.size, self.encoding, self.texels = size, encoding, None

    def due(self, sweep, sweeps):
        """Return whether there is a step in a sweep, 0..sweeps - 1; in the last one there is."""
        left = sweeps - 1 - sweep
        return 2 * left < sweeps and left % EVERY == 0

    def step(self, plane, first, layers, angular, loss, rate):
        """Move texels towards the means over the plane (c, H W) at one pair of directions, angular (width, 1), and
        return ([gradients of first, of layers], of angular), as `network.gradients` does."""
        if self.texels is None:
            self.texels = self._means(plane)
            self.adam = Adam(self.texels)
        values = [self.encoding.decode(forward(first, layers, part, angular)) for part in plane.split(BLOCK, 1)]
        target = self.encoding.encode(self._means(torch.cat(values, 1)))
        found, back, of_angular = gradients(first, layers, self.texels[..., None], angular, target[..., None], loss)
        self.adam.step(back[..., 0], rate)
        return found, of_angular

    def planes(self):
        """Return the levels [(ceil(H / 2), ceil(W / 2), c), ..., (1, 1, c)]."""
        return in_levels(self.texels.T, self.size)

    def _means(self, rows):
        """Return the means (c, n) of `rows` (c, H W) over the texels of all levels."""
        return means(rows.T.reshape(*self.size, -1)).T.contiguous()
