"""An exemplar seen in coordinates along two sides of a cell, so that patches shaped like the cell are rectangles."""

import torch

from neumat.btf.planes import fetch
from neumat.btf.synthesis.cuts import comparable

BEYOND = 0.25  # how much of an exemplar that tiles is seen a second time


class Frame:
    """The `features` (k, P, Q) of an exemplar at samples p w / n + q v / m + origin, for sides v, w in texels.

    plane: (H, W, c). sides: v, w as [(x, y), (x, y)]. steps: m, n, samples along them.
    """

    def __init__(self, plane, sides, steps, tileable):
        height, width, _ = plane.shape
        device = plane.device
        right, down = (
            torch.tensor(side, dtype=torch.float64, device=device) / n for side, n in zip(sides, steps, strict=True)
        )
        self.axes = torch.stack([down, right])  # texels (x, y) of a step in p, in q
        far = torch.tensor([width, height], dtype=torch.float64, device=device)
        far = (1 + BEYOND) * far - 1 if tileable else far - 1
        corners = torch.tensor([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]], dtype=torch.float64, device=device)
        inverse = torch.linalg.inv(self.axes)
        corners = corners * far @ inverse
        least, most = (corners.amin(0) - 1e-9).ceil(), (corners.amax(0) + 1e-9).floor()
        self.origin = least @ self.axes
        p, q = (
            torch.arange(int(b - a) + 1, dtype=torch.float64, device=device) for a, b in zip(least, most, strict=True)
        )
        texels = torch.cartesian_prod(p, q).reshape(len(p), len(q), 2) @ self.axes + self.origin
        self.inside = ((texels > -1e-6) & (texels < far + 1e-6)).all(-1)
        values = comparable(plane).permute(1, 2, 0)
        size = torch.tensor([width, height], device=device)
        values = fetch(values, ((texels + 0.5) / size).flatten(0, 1), tileable).reshape(len(p), len(q), -1)
        self.features = values.permute(2, 0, 1).contiguous()

    def texels(self, samples):
        """Return the texels (..., 2), x and y, int64, nearest to `samples` (..., 2), p and q."""
        return (samples.double() @ self.axes + self.origin).round().long()

    def room(self, height, width):
        """Return where patches of `height` x `width` samples may begin: (P - height + 1, Q - width + 1)."""
        rows, columns = self.inside.shape[0] - height + 1, self.inside.shape[1] - width + 1
        i, j = height - 1, width - 1
        ends = [self.inside[a : a + rows, b : b + columns] for a in (0, i) for b in (0, j)]
        return torch.stack(ends).all(0)
