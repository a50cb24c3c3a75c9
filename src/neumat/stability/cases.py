"""Stresses of BTFs: each names what in the code protects users, and its run returns (what happened, whether that is
right)."""

from neumat.stability.stress import REFUSED, UNNEEDED, WARNED, Answer, Stress


def case(name, expected, guard, run):
    """Return the Stress in which `expected` must happen, with or without a warning. guard: in words."""
    return _stress(name, expected, guard, run, (UNNEEDED, WARNED))


def refused(name, part, guard, run):
    """Return the Stress that must end in a NeumatError whose one line says `part`."""
    return _stress(name, f"refused in one line: {part}", guard, run, (REFUSED,), part)


def warned(name, expected, part, guard, run):
    """Return the Stress in which a warning must say `part`."""
    return _stress(name, f"{expected}, of which a warning tells", guard, run, (WARNED,), part)


def _stress(name, expected, guard, run, guards, part=""):
    return Stress(name, expected, guards, lambda: Answer(*run()), part, guard)
