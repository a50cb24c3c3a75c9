"""No more model than a scene needs: the ladder fitted under a scene's own queries, the cheapest models chosen for a
tolerance, and both pictures rendered to verify it."""

from pathlib import Path
from tempfile import TemporaryDirectory

import pandas as pd
import torch

from neumat.fields.field import Field
from neumat.fields.layout import SIZE, widths_of
from neumat.render.mitsuba_scene import bsdf
from neumat.render.variant import clock
from neumat.scenes.choice import Prediction, alone, choose, upgrade
from neumat.scenes.compose import compose, units
from neumat.scenes.costs import nanoseconds
from neumat.scenes.fits import even_queries, fit_analytic, fit_fields, pools, query_error
from neumat.scenes.models import ANALYTIC, ANALYTIC_SHARE, SMALLER, WIDEST, Model
from neumat.scenes.pictures import render, shown
from neumat.scenes.replay import importance
from neumat.scenes.trace import coverage, trace
from neumat.scenes.visible import flip, object_errors

TRUE = WIDEST  # what a scene's materials are: the fields of NeuMERL and of the generative models


class ModelSelection:
    """What a scene needs of its materials.

    layout: see `compose`; materials: {unit: (name, weights (675,))}; settings: the config's section `scenes`.

    Attributes: ladder {unit: [Model]}, the cheapest first, the field itself last; errors {unit: [predicted mean FLIP of
    its object with each model, all else true]}.
    """

    def __init__(self, layout, materials, settings, seed, progress=iter):
        self.layout, self.materials, self.settings, self.progress = layout, materials, settings, progress
        self.objects = list(layout["objects"])
        traced = settings["trace"]
        composition = self.composed({unit: bsdf(w) for unit, (_, w) in materials.items()}, traced["width"])
        self.trace = trace(composition, layout, traced["samples"], seed)
        self.truth = {unit: Field(weights) for unit, (_, weights) in materials.items()}
        enlarged = settings["verify"]["width"] / traced["width"]
        self.prediction = Prediction(self.trace, self.objects, self.truth, layout["exposure"], enlarged)
        queries = importance(self.trace, self.truth, layout["exposure"])
        self.queries = {unit: len(values) / len(self.trace.first) for unit, (_, values, _) in queries.items()}
        # A material that no path meets has no queries and needs nothing.
        queries = {unit: found for unit, found in queries.items() if float((found[1] * found[2]).sum()) > 0}
        self.units = list(queries)
        self.pools = {
            "scene": pools(queries, self.truth, seed),
            "all angles": pools({unit: even_queries(self.truth[unit], seed) for unit in queries}, self.truth, seed),
        }
        # What a picture shows of an error depends on where it lies: scene fits are told apart by what they show.
        judges = {"scene": self._shown, "all angles": None}
        self.fitted = {under: self._fit(pool, seed, judges[under]) for under, pool in self.pools.items()}
        self.ladder = {
            unit: [*(models[k] for models in self.fitted["scene"].values()), Model(TRUE, materials[unit][1])]
            for k, unit in enumerate(self.units)
        }
        self.errors = alone(self.prediction, self.ladder)

    def composed(self, plugins, width):
        height = round(width * self.settings["height"] / self.settings["width"])
        return compose(self.layout, plugins, width, height)

    def _shown(self, numbers):
        """Return the predicted mean FLIP (u,) of each unit's object with a field of numbers (u, n), all else true."""
        fields = zip(self.units, numbers, strict=True)
        found = [self.prediction.errors({u: Field(x, widths_of(len(x)))})[u[0]] for u, x in fields]
        return torch.tensor(found)

    def _fit(self, pool, seed, judge):
        """Return {rung: [Model of each unit]} below the true one, fitted under a Pools, the best by `judge`."""
        fields = torch.stack([self.materials[unit][1] for unit in self.units])
        steps = self.settings["fit_steps"]
        fitted = {rung: fit_analytic(rung, pool, steps // ANALYTIC_SHARE, seed) for rung in self.progress(ANALYTIC)}
        return fitted | fit_fields(SMALLER, pool, fields, steps, seed, self.progress, judge)

    def fits(self):
        """Return a DataFrame of every fit under either distribution of queries, at equal weights.

        object, material, rung, under; flip: predicted on the object; error_scene, error_angles: share of what is
        reflected (see `fits.query_error`), under the scene's queries and under all angles.
        """
        rows = []
        for under, fitted in self.fitted.items():
            for rung, models in fitted.items():
                for k, (unit, model) in enumerate(zip(self.units, models, strict=True)):
                    seen = self.prediction.errors({unit: model.material})[unit[0]]
                    shares = [_error(model.material, pool, k) for pool in self.pools.values()]
                    rows.append((*self._names(unit), rung, under, seen, *shares))
        return pd.DataFrame(
            rows, columns=["object", "material", "rung", "under", "flip", "error_scene", "error_angles"]
        )

    def _names(self, unit):
        return unit[0], self.materials[unit][0]

    def table(self):
        """Return a DataFrame with a row for each of the settings' tolerances and each material of each object.

        tolerance; object, material, rung, bytes, ns (of a query); queries: of a path; fit_seconds; predicted and
        measured: mean FLIP of the object with all materials' chosen models; noise: the same between two pictures of
        the true ones; seconds: of the picture by `clock`; upgrades: how often the pictures asked for better models than
        were predicted. *_true: the same of the true materials.
        """
        with TemporaryDirectory() as folder:
            verifier = _Verifier(self, Path(folder))
            ns = {model.rung: nanoseconds(model.plugin(Path(folder))) for model in self.ladder[self.units[0]]}
            rows = []
            for tolerance in self.progress(self.settings["tolerances"]):
                chosen, predicted = choose(self.prediction, self.ladder, self.errors, tolerance)
                upgrades = 0
                while True:
                    measured, seconds = verifier.measure(chosen)
                    worst = max(measured, key=measured.get)
                    if measured[worst] <= tolerance or not upgrade(chosen, self.errors, worst):
                        break
                    upgrades += 1
                    predicted = self.prediction.errors(self.models(chosen))
                for unit, k in chosen.items():
                    model, name = self.ladder[unit][k], unit[0]
                    cost = model.rung, model.bytes, ns[model.rung], self.queries[unit], model.seconds
                    errors = predicted[name], measured[name], verifier.noise[name]
                    rows.append((tolerance, *self._names(unit), *cost, *errors, seconds, upgrades))
        columns = ["tolerance", "object", "material", "rung", "bytes", "ns", "queries", "fit_seconds"]
        table = pd.DataFrame(rows, columns=[*columns, "predicted", "measured", "noise", "seconds", "upgrades"])
        return table.assign(bytes_true=4 * SIZE, ns_true=ns[TRUE], seconds_true=verifier.seconds)

    def models(self, chosen):
        """Return {unit: material} of chosen positions in the ladder."""
        return {unit: self.ladder[unit][k].material for unit, k in chosen.items()}


class _Verifier:
    """Renders the scene with the true materials and with chosen ones, from the same random numbers."""

    def __init__(self, needs, folder):
        self.needs, self.folder, self.found = needs, folder, {}
        self.true = {unit: len(models) - 1 for unit, models in needs.ladder.items()}
        composition = self._composition(self.true)
        self.coverage = coverage(composition, needs.layout)
        self.picture, self.seconds = self._timed(composition)
        other, _ = self._timed(composition, seed=2)
        self.noise = object_errors(flip(self.picture, other), self.coverage)

    def measure(self, chosen):
        """Return ({object: mean FLIP}, seconds of the picture by `clock`)."""
        key = tuple(sorted(chosen.items()))
        if chosen == self.true:
            return dict.fromkeys(self.coverage, 0.0), self.seconds
        if key not in self.found:
            picture, seconds = self._timed(self._composition(chosen))
            self.found[key] = object_errors(flip(self.picture, picture), self.coverage), seconds
        return self.found[key]

    def _composition(self, chosen):
        needs = self.needs
        plugins = {unit: bsdf(weights) for unit, (_, weights) in needs.materials.items()}
        plugins |= {unit: needs.ladder[unit][k].plugin(self.folder) for unit, k in chosen.items()}
        return needs.composed(plugins, needs.settings["verify"]["width"])

    def _timed(self, composition, seed=0):
        """Return the picture as shown, and the seconds by `clock` of its second half: the first compiles the kernel."""
        half = self.needs.settings["verify"]["samples"] // 2
        total = render(composition, half, seed)
        start = clock()
        total = total + render(composition, half, seed + 1)
        return shown(total / 2, self.needs.layout["exposure"]), 2 * (clock() - start)


def _error(material, pool, k):
    found = material.eval(*(axis[k] for axis in pool.angles))
    return float(query_error(found, pool.values[k], pool.floor[k]))


def layout_materials(layout, materials):
    """Return {unit: (name, weights (675,))} of a layout, found in a Materials."""
    return {unit: materials.find(name) for unit, name in units(layout).items()}
