"""The cheapest model of each material that keeps a picture within a limit of mean FLIP on every object."""

from neumat.metrics.flip import flip
from neumat.scenes.pictures import shown
from neumat.scenes.replay import queried, replay
from neumat.scenes.visible import object_errors


class Prediction:
    """Predicts what models of a scene's materials would show, from a Trace of it with the true ones.

    truth: {unit: material}; exposure: of the layout; enlarged: pixels of the final picture along one of the trace's.
    """

    def __init__(self, trace, objects, truth, exposure, enlarged):
        self.trace, self.exposure, self.enlarged = trace, exposure, enlarged
        self.values = queried(trace, truth)
        self.coverage = {name: trace.coverage(k).numpy() for k, name in enumerate(objects)}
        self.picture = self._picture(self.values)

    def errors(self, materials):
        """Return {object: mean FLIP} with `materials`, {unit: material}, in place of the true ones."""
        found = self._picture(self.values | queried(self.trace, materials))
        return object_errors(flip(self.picture, found, self.enlarged), self.coverage)

    def _picture(self, values):
        return shown(self.trace.picture(replay(self.trace, values)), self.exposure)


def alone(prediction, ladder):
    """Return {unit: [error of its object with each model of the ladder {unit: [Model]}, all else true]}."""
    return {
        unit: [prediction.errors({unit: model.material})[unit[0]] for model in models]
        for unit, models in ladder.items()
    }


def limits(tolerance, best):
    """Return {object: mean FLIP that it may show}: the tolerance, or what it shows with the dearest models where that
    is more. `best`: {object: that error}. No model but the table itself could do better."""
    return {name: max(tolerance, error) for name, error in best.items()}


def furthest(found, allowed):
    """Return the object whose error, of {object: error}, exceeds its limit by most, None where none does."""
    worst = max(found, key=lambda name: found[name] - allowed[name])
    return worst if found[worst] > allowed[worst] else None


def choose(prediction, ladder, errors, allowed):
    """Return ({unit: position in its ladder}, {object: predicted error}).

    ladder: {unit: [Model]}, the cheapest first, the dearest last; errors: of `alone`; allowed: of `limits`. Each
    material gets the cheapest model that stays within its object's limit alone; then, while an object of the whole
    exceeds its own, what shows most on it is mended first. What was mended before the rest may be better than it has to
    be by then: the dearest first, each is exchanged for the cheapest that leaves all objects within their limits.
    """
    least = {
        unit: next(k for k, error in enumerate(found) if error <= allowed[unit[0]] or k == len(found) - 1)
        for unit, found in errors.items()
    }

    def predict(chosen):
        return prediction.errors({unit: ladder[unit][k].material for unit, k in chosen.items()})

    chosen = dict(least)
    while True:
        predicted = predict(chosen)
        worst = furthest(predicted, allowed)
        if worst is None or not upgrade(chosen, errors, worst):
            break
    for unit in sorted(chosen, key=chosen.get, reverse=True):
        for k in range(least[unit], chosen[unit]):
            cheaper = predict(chosen | {unit: k})
            if furthest(cheaper, allowed) is None:
                chosen[unit], predicted = k, cheaper
                break
    return chosen, predicted


def upgrade(chosen, errors, name):
    """Move to a better model what shows most on the object `name`; return whether anything was left to move.

    Its own materials first, then those that it reflects.
    """
    own = [unit for unit in chosen if unit[0] == name and chosen[unit] < len(errors[unit]) - 1]
    left = own or [unit for unit in chosen if chosen[unit] < len(errors[unit]) - 1]
    if not left:
        return False
    unit = max(left, key=lambda unit: errors[unit][chosen[unit]])
    better = [k for k in range(chosen[unit] + 1, len(errors[unit])) if errors[unit][k] < errors[unit][chosen[unit]]]
    chosen[unit] = better[0] if better else len(errors[unit]) - 1
    return True
