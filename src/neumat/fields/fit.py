"""Fitting neural fields in batches: many materials at once, one set of directions a step.

The loss is NBRDF's mean absolute logarithmic cosine difference (Sztrajman et al. 2021, eq. 2). Forward and backward
passes are written out: at 21 units a framework's bookkeeping costs more than the arithmetic.

phi_d and phi_d + pi are the same pair of directions, and everything here folds phi_d to [0, pi) before it evaluates a
field. Other programs that read these weights do not fold (Neural-BRDF's plugin among them), so a share of every batch
shows a direction by its mirror image (-d_x, -d_y).
"""

import math

import torch

from neumat.brdf.coordinates import GRID, cosines, grid_angles, half_difference
from neumat.errors import NeumatError
from neumat.fields.layout import WIDTHS, matrices, size, unpack
from neumat.fields.optimisers import Adam, Soap
from neumat.seeds import torch_generator

GROUP = 68  # materials side by side: 400 make 6 groups, which fill two cores; half as many cost 1.3 times as much each
FILL = 17  # short groups are filled up to a multiple of this, which the 34 of chart 1 are
HELD_OUT = 0.2
OUTLIER = 0.25  # of what a constant reflectance loses
CANDIDATES, ROUNDS = 8, 4  # of the first field
FIRST = {"batch_size": 1024, "learning_rate": 1e-2}  # of the first field
# Share of a batch that is mirrored. Without any, the brightness over the mirrored half is off by 8 % in the median; an
# eighth, taken from the directions drawn by uniform angles, leaves .6 %, and 4 % more loss; a half 33 % more loss.
MIRRORED = 1 / 8


class Directions:
    """The directions of a store's entries, split 80/20 into training and held-out ones, the same for all materials.

    Attributes: rows (V, 8), each the six inputs, a one and the cosine of the light; inputs (V, 6) and cosine (V, 1),
    views of them; uniform (V,) weights that make a mean over entries a mean over uniform angles, train and held
    (positions).
    """

    def __init__(self, entries, seed):
        entries = torch.as_tensor(entries, dtype=torch.long)
        angles = grid_angles(entries)
        cosine = cosines(*angles)[0][:, None]
        self.rows = torch.cat([half_difference(*angles), torch.ones_like(cosine), cosine], 1)
        self.inputs, self.cosine = self.rows[:, :6], self.rows[:, 7:]
        # The grid's theta_h axis is quadratic, so the entries of row i stand for an interval that grows with i.
        self.uniform = 2.0 * (entries // (GRID[1] * GRID[2])).float() + 1.0
        order = torch.randperm(len(entries), generator=torch_generator(seed, "held-out entries"))
        held = round(HELD_OUT * len(entries))
        self.held, self.train = order[:held], order[held:]


def training_order(directions, config, seed):
    """Return the positions (steps, batch) that training visits.

    The first part of every batch, a share `highlight_share`, goes through the grid entries in random order, epoch after
    epoch: the grid is dense in the highlight. The rest is drawn by uniform angles.
    """
    steps = max(1, config["samples"] // config["batch_size"])
    dense = round(config["highlight_share"] * config["batch_size"])
    generator = torch_generator(seed, "training order")
    train = directions.train
    epochs = math.ceil(steps * dense / len(train))
    walked = [train[torch.randperm(len(train), generator=generator)] for _ in range(epochs)]
    parts = [torch.cat(walked)[: steps * dense].view(steps, dense)] if dense else []
    if dense < config["batch_size"]:
        spread = steps * (config["batch_size"] - dense)
        cumulative = directions.uniform[train].double().cumsum(0)
        draws = torch.rand(spread, generator=generator, dtype=torch.float64) * cumulative[-1]
        parts.append(train[torch.searchsorted(cumulative, draws).clamp_max(len(train) - 1)].view(steps, -1))
    return torch.cat(parts, 1)


def learning_rate(step, steps, config):
    """Return the learning rate at `step`: constant, or a cosine from `learning_rate` to 0."""
    if config["schedule"] == "constant":
        return config["learning_rate"]
    return config["learning_rate"] * 0.5 * (1 + math.cos(math.pi * step / steps))


def stacked(weights, widths=WIDTHS):
    """Return the layers of fields (K, size), each (K, out + 1, in + 1): the transposed kernel, the bias as last column,
    and a last row that hands a one on, so that products with `inputs` that end in ones need no bias of their own."""
    layers = []
    for matrix in matrices(weights, widths):
        count, below, above = matrix.shape
        layer = weights.new_zeros(count, above + 1, below)
        layer[:, :-1], layer[:, -1, -1] = matrix.mT, 1
        layers.append(layer)
    return layers


def gradient(layers, inputs, cosine, target, dtype):
    """Return d loss / d of each of the `stacked` layers without its last row, of the mean |log(1 + f cos) - target| of
    each of K fields.

    inputs (n, 7): the six coordinates and a column of ones; cosine (n,); target (K, 3, n) = log(1 + f cos).
    """
    first, second, third = (layer.to(dtype) for layer in layers)
    count, n = len(first), len(inputs)
    hidden1 = (first.flatten(0, 1) @ inputs.T).view(count, -1, n).relu_()
    hidden2 = (second @ hidden1).relu_()
    slope = torch.exp((third[:, :-1] @ hidden2).float()).mul_(cosine)
    lit = slope + (1 - cosine)  # 1 + f cos
    delta = torch.log(lit).sub_(target).sign_().mul_(slope).div_(lit).mul_(1 / (3 * n)).to(dtype)

    masked = torch.ops.aten.threshold_backward  # the gradient of ReLU, in one pass
    back2 = masked(third[:, :-1, :-1].mT @ delta, hidden2[:, :-1], 0)
    back1 = masked(second[:, :-1, :-1].mT @ back2, hidden1[:, :-1], 0)
    below = (back1.flatten(0, 1) @ inputs).view(count, -1, inputs.shape[1])
    return [part.float() for part in (below, back2 @ hidden1.mT, delta @ hidden2.mT)]


def soap(matrix):
    """Return the optimiser of the first field and of the polish."""
    return Soap(matrix, momentum=0.9)


def descend(values, directions, start, config, seed, widths=WIDTHS, progress=iter):
    """Return the fitted weights (K, size): by Adam from `start` (K, size), polished by SOAP.

    SOAP alone reaches the same loss with a quarter of the samples, but along directions of each material's own: 256
    principal axes of all fields then leave five times the error that they leave of Adam's, and a model of their
    distribution has more to learn. A short polish at a low rate keeps what Adam's fields have in common.
    values, start: see `train`. config: the section `fit`.
    """
    polish = config | config["polish"]
    for optimiser, stage, name in ((Adam, config, seed), (soap, polish, f"{seed}/polish")):
        if stage["samples"]:
            start = train(values, directions, start, stage, optimiser, name, widths, progress)
    return start


def train(values, directions, start, config, optimiser, seed, widths=WIDTHS, progress=iter, mirrored=MIRRORED):
    """Return the trained weights (K, size) from `start` (K, size).

    values: (V, k, 3), 1/sr, of k materials; field i is trained on material i modulo k. config: samples, batch_size,
    highlight_share, learning_rate, schedule, precision. optimiser: one for a layer's matrix, see `fields.optimisers`.
    `progress` wraps the range of steps. mirrored: the share of a batch that is mirrored, its end, see `training_order`.
    """
    dtype = getattr(torch, config["precision"])
    order = training_order(directions, config, seed)
    layers = stacked(start, widths)
    parameters = [layer[:, :-1] for layer in layers]
    optimisers = [optimiser(parameter) for parameter in parameters]
    shape, materials = (len(start), 3, config["batch_size"]), torch.arange(len(start)) % values.shape[1]
    steps, plain = len(order), math.floor((1 - mirrored) * config["batch_size"])
    for step in progress(range(steps)):
        batch = directions.rows.index_select(0, order[step])
        batch[plain:, 3:5].neg_()
        inputs, cosine = batch[:, :-1].to(dtype), batch[:, -1].contiguous()
        reflected = values.index_select(0, order[step]).index_select(1, materials).flatten(1).T.float()
        target = reflected.mul_(cosine).log1p_().view(shape)
        grad = gradient(layers, inputs, cosine, target, dtype)
        rate = learning_rate(step, steps, config)
        for layer, part in zip(optimisers, grad, strict=True):
            layer.step(part, rate)
    return torch.cat([parameter.mT.flatten(1) for parameter in parameters], 1)


@torch.no_grad()
def losses(weights, values, directions, positions, widths=WIDTHS, block=1 << 10):
    """Return (over grid entries, over uniform angles, of a constant), each (K,): mean log-cosine losses.

    The third is the null baseline: the loss of the best constant log(1 + f cos) of each channel, over the entries.
    """
    total = torch.zeros(3, len(weights), dtype=torch.float64)
    probe = positions[: 1 << 12]
    middle = torch.log1p(values[probe].float() * directions.cosine[probe][:, :, None]).median(0).values[:, :, None]
    *hidden, last = stacked(weights, widths)
    for part in positions.split(block):
        rows = directions.rows[part].T.contiguous()
        x, cosine = rows[:-1], rows[-1]
        target = (values[part].permute(1, 2, 0).float() * cosine).log1p_()
        for layer in hidden:
            x = (layer @ x).relu_()
        found = (last[:, :-1] @ x).expm1_().clamp_min_(0).mul_(cosine).log1p_()
        error = found.sub_(target).abs_().mean(1)
        total[0] += error.sum(1)
        # Not a product of matrices, whose last digits depend on how many materials there are.
        total[1] += (error * directions.uniform[part]).sum(1)
        total[2] += (middle - target).abs_().mean(1).sum(1)
    uniform = directions.uniform[positions].double().sum()
    return total[0] / len(positions), total[1] / uniform, total[2] / len(positions)


def fit(values, directions, first, config, seed, widths=WIDTHS, progress=iter):
    """Fit K materials, at most GROUP; return a dict of tensors: weights, loss_grid, loss_uniform, converged, retried.

    first: (size,) weights that all start from. A fit that diverges, or loses more than OUTLIER of what a constant
    loses, is retried from random weights; the better fit is kept and flagged, and `converged` says whether it is
    good. Short groups are filled up, so that a material's result does not depend on its neighbours.
    Raises NeumatError for more than GROUP materials.
    """
    count = values.shape[1]
    if count > GROUP:
        raise NeumatError("fit", f"at most {GROUP} materials at a time", count)
    filled = math.ceil(count / FILL) * FILL
    weights = descend(values, directions, first.expand(filled, -1), config, seed, widths, progress)[:count]
    grid, uniform, null = losses(weights, values, directions, directions.held, widths)
    bad = ~(grid < OUTLIER * null)
    if bad.any():
        start = random_weights(widths, seed, "retry").expand(filled, -1)
        again = descend(values, directions, start, config, f"{seed}/retry", widths, progress)[:count]
        new_grid, new_uniform, _ = losses(again, values, directions, directions.held, widths)
        better = bad & ~(new_grid >= grid)
        weights = torch.where(better[:, None], again, weights)
        grid, uniform = torch.where(better, new_grid, grid), torch.where(better, new_uniform, uniform)
    return {
        "weights": weights,
        "loss_grid": grid,
        "loss_uniform": uniform,
        "loss_constant": null,
        "converged": grid < OUTLIER * null,
        "retried": bad,
    }


def random_weights(widths, seed, name):
    """Return (size,) weights to start from: half of He's standard deviation, biases 0."""
    generator = torch_generator(seed, name)
    weights = torch.zeros(size(widths))
    for kernel, _ in unpack(weights, widths):
        kernel[:] = torch.randn(kernel.shape, generator=generator) * math.sqrt(0.5 / len(kernel))
    return weights


def first_field(values, directions, config, seed, widths=WIDTHS, progress=iter):
    """Return (size,) weights fitted to one material (V, 1, 3) with every unit at work: the start of all other fits.

    A ReLU unit that no direction switches on stays dead, here and in every fit that starts here: left alone, 13 of 21
    units die, and the fits lose twice as much. So the budget, `first_samples`, goes in ROUNDS, and dead units start
    afresh between them. All fits gain from a good start, so it takes more samples than they do, and CANDIDATES begin,
    of which the better half is left after each round (successive halving, Jamieson and Talwalkar 2016): by luck alone
    one loses .0026 and another .0041, and the fits that start there .0029 and .0035.
    """
    weights = torch.stack([random_weights(widths, seed, f"first field {k}") for k in range(CANDIDATES)])
    config = config | FIRST | {"samples": config["first_samples"] // ROUNDS}
    for k in range(ROUNDS):
        fresh = random_weights(widths, seed, f"revival {k}")
        weights = torch.stack([revive(one, directions.inputs[::97], fresh, widths) for one in weights])
        weights = train(values, directions, weights, config, soap, f"{seed}/first {k}", widths, progress)
        loss, _, _ = losses(weights, values, directions, directions.train[::97], widths)
        weights = weights[loss.argsort()[: max(1, len(weights) // 2)]]
    return weights[0]


def revive(weights, inputs, fresh, widths=WIDTHS):
    """Return the weights (size,) with those hidden units that are 0 at all `inputs` (m, 6) taken from `fresh`.

    A unit taken over has no effect on the next layer yet, so the field stays as it is.
    """
    weights, x = weights.clone(), inputs
    layers, new = unpack(weights, widths), unpack(fresh, widths)
    for k, (kernel, bias) in enumerate(layers[:-1]):
        dead = ~(x @ kernel + bias > 0).any(0)
        kernel[:, dead], bias[dead] = new[k][0][:, dead], new[k][1][dead]
        layers[k + 1][0][dead] = 0
        x = torch.relu(x @ kernel + bias)
    return weights
