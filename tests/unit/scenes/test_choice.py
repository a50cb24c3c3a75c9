"""The choice of models, with predictions that are sums of what each model does alone."""

from types import SimpleNamespace

import pytest

from neumat.scenes.choice import choose, furthest, limits, upgrade

TOLERANCE = 0.05


class Sums:
    """Predicts for an object the sum of the errors of its units, and a share of those of the other objects."""

    def __init__(self, errors, reflected=0.0):
        self.alone, self.reflected, self.count = errors, reflected, 0

    def errors(self, materials):
        self.count += 1
        errors = {unit: self.alone[unit][k] for unit, k in materials.items()}
        names = {name for name, _ in errors}
        return {
            name: sum(error * (1 if unit[0] == name else self.reflected) for unit, error in errors.items())
            for name in names
        }


def ladder(errors):
    """Models whose materials are their positions."""
    return {unit: [SimpleNamespace(material=k) for k in range(len(found))] for unit, found in errors.items()}


def within(errors, tolerance):
    """The same limit for every object."""
    return {name: tolerance for name, _ in errors}


def test_each_material_gets_the_cheapest_model_within_the_tolerance():
    errors = {("a", 0): [0.2, 0.04, 0.01, 0.0], ("b", 0): [0.03, 0.02, 0.01, 0.0]}
    chosen, predicted = choose(Sums(errors), ladder(errors), errors, within(errors, TOLERANCE))
    assert chosen == {("a", 0): 1, ("b", 0): 0}
    assert predicted == pytest.approx({"a": 0.04, "b": 0.03})


def test_a_cheap_model_may_be_better_than_a_dear_one():
    errors = {("a", 0): [0.04, 0.3, 0.2, 0.0]}
    assert choose(Sums(errors), ladder(errors), errors, within(errors, TOLERANCE))[0] == {("a", 0): 0}


def test_what_adds_up_on_an_object_is_mended_where_it_shows_most():
    errors = {("a", 0): [0.03, 0.01, 0.0], ("a", 1): [0.04, 0.015, 0.0], ("b", 0): [0.04, 0.01, 0.0]}
    chosen, predicted = choose(Sums(errors), ladder(errors), errors, within(errors, TOLERANCE))
    assert chosen == {("a", 0): 0, ("a", 1): 1, ("b", 0): 0}
    assert max(predicted.values()) <= TOLERANCE


def test_what_was_mended_first_is_exchanged_where_the_rest_suffices():
    errors = {("a", 0): [0.04, 0.02, 0.0], ("a", 1): [0.035, 0.0]}
    chosen, predicted = choose(Sums(errors), ladder(errors), errors, within(errors, TOLERANCE))
    assert chosen == {("a", 0): 0, ("a", 1): 1}
    assert predicted == pytest.approx({"a": 0.04})


def test_reflections_of_another_object_are_mended_last():
    errors = {("a", 0): [0.04, 0.0], ("b", 0): [0.045, 0.0]}
    assert choose(Sums(errors, 0.5), ladder(errors), errors, within(errors, TOLERANCE))[0] == {("a", 0): 0, ("b", 0): 1}
    chosen, predicted = choose(Sums(errors, 1.2), ladder(errors), errors, within(errors, 0.0))
    assert chosen == {("a", 0): 1, ("b", 0): 1} and max(predicted.values()) == 0


def test_a_limit_that_nothing_meets_ends_with_the_dearest_models():
    errors = {("a", 0): [0.2, 0.1, 0.09], ("b", 0): [0.2, 0.1, 0.09]}
    sums = Sums(errors)
    chosen, _ = choose(sums, ladder(errors), errors, within(errors, 0.01))
    assert chosen == {unit: 2 for unit in errors} and sums.count == 1


def test_upgrade_skips_models_that_are_no_better():
    errors = {("a", 0): [0.1, 0.2, 0.1, 0.05, 0.0]}
    chosen = {("a", 0): 0}
    assert upgrade(chosen, errors, "a") and chosen == {("a", 0): 3}
    assert upgrade(chosen, errors, "a") and chosen == {("a", 0): 4}
    assert not upgrade(chosen, errors, "a") and chosen == {("a", 0): 4}


def test_upgrade_takes_the_true_material_where_none_is_better_alone():
    errors = {("a", 0): [0.0, 0.0, 0.0]}
    chosen = {("a", 0): 0}
    assert upgrade(chosen, errors, "a") and chosen == {("a", 0): 2}


def test_upgrade_moves_an_objects_own_materials_before_those_it_reflects():
    errors = {("a", 0): [0.01, 0.0], ("b", 0): [0.5, 0.0]}
    chosen = {("a", 0): 0, ("b", 0): 0}
    assert upgrade(chosen, errors, "a") and chosen == {("a", 0): 1, ("b", 0): 0}
    assert upgrade(chosen, errors, "a") and chosen == {("a", 0): 1, ("b", 0): 1}


def test_an_object_may_show_what_its_dearest_models_show():
    assert limits(0.02, {"a": 0.03, "b": 0.0}) == {"a": 0.03, "b": 0.02}


def test_the_furthest_object_is_the_one_most_beyond_its_own_limit():
    allowed = {"a": 0.03, "b": 0.01}
    assert furthest({"a": 0.035, "b": 0.02}, allowed) == "b"
    assert furthest({"a": 0.03, "b": 0.01}, allowed) is None


def test_an_object_whose_field_misses_the_tolerance_drags_no_other_along():
    """The best of a's models shows .03; b would meet the tolerance with its cheapest."""
    errors = {("a", 0): [0.2, 0.05, 0.03], ("b", 0): [0.005, 0.001, 0.0]}
    allowed = limits(0.01, {"a": 0.03, "b": 0.0})
    chosen, predicted = choose(Sums(errors), ladder(errors), errors, allowed)
    assert chosen == {("a", 0): 2, ("b", 0): 0}
    assert predicted == pytest.approx({"a": 0.03, "b": 0.005})
