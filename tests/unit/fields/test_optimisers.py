"""SOAP: what preconditioning in an eigenbasis promises."""

import torch

from neumat.fields.optimisers import Adam, Soap


def descend(start, gradient, steps=200, rate=0.05):
    """Return where `steps` of Soap lead from `start` (n, a, b), the rate falling linearly to 0."""
    parameter = start.clone()
    optimiser = Soap(parameter)
    for step in range(steps):
        optimiser.step(gradient(parameter), rate * (1 - step / steps))
    return parameter


def problem(seed=0, n=3, a=6, b=5, condition=1e4):
    """Return (start, target, gradient) of 0.5 |A (W - target)|^2 with a rotated A of that condition number."""
    generator = torch.Generator().manual_seed(seed)
    axes = torch.linalg.qr(torch.randn(n, a, a, generator=generator, dtype=torch.float64)).Q
    curvature = (axes * torch.logspace(0, -torch.log10(torch.tensor(condition)), a, dtype=torch.float64)) @ axes.mT
    target = torch.randn(n, a, b, generator=generator, dtype=torch.float64)
    start = torch.zeros_like(target)
    return start, target, lambda w: curvature @ (w - target)


def test_it_reaches_the_minimum_of_a_badly_conditioned_problem():
    start, target, gradient = problem()
    plain = start.clone()
    for _ in range(200):
        plain -= gradient(plain)  # the largest step that is stable
    assert (descend(start, gradient) - target).norm() < 0.1 * (plain - target).norm()


def test_matrices_of_a_batch_do_not_see_each_other():
    start, target, gradient = problem()
    together = descend(start, gradient)
    for i in range(len(start)):
        alone = descend(start[i : i + 1], lambda w, i=i: gradient(w.expand_as(target))[i : i + 1])
        torch.testing.assert_close(alone[0], together[i], rtol=1e-6, atol=1e-6)


def test_a_turned_problem_is_solved_in_the_same_way():
    """Adam alone fails this: its steps depend on the axes."""
    start, _target, gradient = problem()
    generator = torch.Generator().manual_seed(1)
    turn = torch.linalg.qr(torch.randn(6, 6, generator=generator, dtype=torch.float64)).Q
    turned = descend(turn @ start, lambda w: turn @ gradient(turn.T @ w), steps=60)
    torch.testing.assert_close(turn.T @ turned, descend(start, gradient, steps=60), rtol=1e-3, atol=1e-3)


def test_a_network_that_has_diverged_stops_no_other():
    start, _target, gradient = problem()
    broken = start.clone()
    broken[1] = torch.nan
    found, expected = descend(broken, gradient), descend(start, gradient)
    assert found[1].isnan().all()
    torch.testing.assert_close(found[[0, 2]], expected[[0, 2]], rtol=1e-6, atol=1e-6)


def test_adam_is_that_of_pytorch():
    start, _, gradient = problem()
    theirs, ours = start.clone().requires_grad_(), start.clone()
    optimiser, adam = torch.optim.Adam([theirs], lr=0.05), Adam(ours)
    for _ in range(20):
        theirs.grad = gradient(theirs.detach())
        optimiser.step()
        adam.step(gradient(ours), 0.05)
    torch.testing.assert_close(ours, theirs.detach())
