"""Optimisers of many small networks at once: each parameter holds the same layer of n of them.

Adam (Kingma and Ba 2015) is the papers'. SOAP (Vyas et al. 2024) is Adam in the eigenbasis of Shampoo's preconditioner:
networks this small are badly conditioned and cheap to precondition, so that it needs a fraction of the samples
(chart 1). Libraries precondition one matrix at a time.
"""

import torch

DECAY = 0.95  # of the running averages of squares and factors, and of the gradient where nothing else is said
EVERY = 20  # steps between two updates of the eigenbases
EPSILON = 1e-8


class Adam:
    """Adam with PyTorch's defaults, of one parameter of any shape, changed in place."""

    def __init__(self, parameter):
        self.parameter = parameter
        self.mean, self.square = torch.zeros_like(parameter), torch.zeros_like(parameter)
        self.count = 0

    def step(self, gradient, rate):
        """Move the parameter against `gradient`, of its shape, at the learning rate `rate`."""
        self.count += 1
        self.mean.lerp_(gradient, 0.1)
        self.square.mul_(0.999).addcmul_(gradient, gradient, value=0.001)
        scale = (self.square / (1 - 0.999**self.count)).sqrt_().add_(EPSILON)
        self.parameter.addcdiv_(self.mean, scale, value=-rate / (1 - 0.9**self.count))


class Soap:
    """SOAP of one parameter (n, a, b): n independent matrices, changed in place.

    momentum: the decay of the gradient's running average. The first step only sets the eigenbases up.
    """

    def __init__(self, parameter, momentum=DECAY):
        self.parameter, self.momentum = parameter, momentum
        self.mean, self.square = (torch.zeros_like(parameter, requires_grad=False) for _ in range(2))
        self.count = 0

    @torch.no_grad()
    def step(self, gradient, rate):
        """Move the parameter against `gradient` (n, a, b) at the learning rate `rate`."""
        if self.count == 0:
            self.factors = [gradient @ gradient.mT, gradient.mT @ gradient]
            # One network that has diverged does not stop the others.
            self.bases = [torch.linalg.eigh(factor.nan_to_num()).eigenvectors for factor in self.factors]
        else:
            left, right = self.bases
            self.mean.lerp_(gradient, 1 - self.momentum)
            turned = left.mT @ gradient @ right
            self.square.lerp_(turned.square(), 1 - DECAY)
            scale = (self.square / (1 - DECAY**self.count)).sqrt_().add_(EPSILON).mul_(1 - self.momentum**self.count)
            self.parameter.sub_(left @ ((left.mT @ self.mean @ right) / scale) @ right.mT, alpha=rate)
            self.factors[0].lerp_(gradient @ gradient.mT, 1 - DECAY)
            self.factors[1].lerp_(gradient.mT @ gradient, 1 - DECAY)
            if self.count % EVERY == 0:
                self._turn()
        self.count += 1

    def _turn(self):
        """Bring the eigenbases up to date by one power iteration (algorithm 4), the largest eigenvalue first.

        The squares follow their eigenvectors.
        """
        for side, dimension in ((0, 1), (1, 2)):
            factor, basis = self.factors[side], self.bases[side]
            order = (basis * (factor @ basis)).sum(1).argsort(1, descending=True)
            basis = basis.gather(2, order[:, None].expand_as(basis))
            index = order.unsqueeze(3 - dimension).expand_as(self.square)
            self.square = self.square.gather(dimension, index)
            self.bases[side] = torch.linalg.qr(factor @ basis).Q
