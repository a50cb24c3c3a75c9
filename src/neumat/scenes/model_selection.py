"""No more model than a scene needs: the ladder fitted under a scene's own queries, the cheapest models chosen for a
tolerance, and both pictures rendered to verify it.

A material's truth is its table, where it has one, else its field, as for sampled materials. All its models are drawn
by the truth's lobes, so that at equal seeds all pictures trace the same paths and differ by values only. Models are
chosen on pictures of one pair of seeds, CHOOSING, and reported on fresh ones, REPORTING.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import pandas as pd
import torch

from neumat.fields.field import Field
from neumat.fields.layout import SIZE, widths_of
from neumat.metrics.flip import flip
from neumat.render.lobes import fit_lobes
from neumat.render.variant import clock
from neumat.scenes.choice import Prediction, alone, choose, furthest, limits, upgrade
from neumat.scenes.compose import compose, units
from neumat.scenes.costs import nanoseconds
from neumat.scenes.fits import even_queries, fit_analytic, fit_fields, pools, query_error
from neumat.scenes.models import ANALYTIC, ANALYTIC_SHARE, SMALLER, WIDEST, Model
from neumat.scenes.pictures import render, shown
from neumat.scenes.replay import importance
from neumat.scenes.trace import coverage, trace
from neumat.scenes.visible import object_errors

CHOOSING, REPORTING, NOISE = 0, 2, 4  # seeds of pictures; each takes this one and the next


class ModelSelection:
    """What a scene needs of its materials.

    layout: see `compose`; materials: {unit: (name, weights (675,))}; tables: {name: Table} of those that have one;
    settings: the config's section `scenes`.

    Attributes: true {unit: Model}: its table, or its field; ladder {unit: [Model]}, the cheapest first, the field last;
    errors {unit: [predicted mean FLIP of its object with each model, all else true]}.
    """

    def __init__(self, layout, materials, tables, settings, seed, progress=iter):
        self.layout, self.materials, self.settings, self.progress = layout, materials, settings, progress
        self.objects = list(layout["objects"])
        fields = {unit: Model(WIDEST, weights) for unit, (_, weights) in materials.items()}
        known = {name: Model.of_table(table) for name, table in tables.items()}
        self.true = {unit: known.get(name, fields[unit]) for unit, (name, _) in materials.items()}
        self.truth = {unit: model.material for unit, model in self.true.items()}
        self.lobes = {unit: fit_lobes(material) for unit, material in self.truth.items()}
        traced = settings["trace"]
        with TemporaryDirectory() as folder:
            composition = self.composed(self.true, traced["width"], Path(folder))
        self.trace = trace(composition, layout, traced["samples"], seed)
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
            unit: [*(models[k] for models in self.fitted["scene"].values()), fields[unit]]
            for k, unit in enumerate(self.units)
        }
        self.errors = alone(self.prediction, self.ladder)

    def composed(self, models, width, folder):
        """Return the Composition with {unit: Model}; tables are written into `folder`, and read here."""
        height = round(width * self.settings["height"] / self.settings["width"])
        plugins = {unit: model.plugin(folder, self.lobes[unit]) for unit, model in models.items()}
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

        tolerance; object, material; truth: table or field; rung, bytes, ns (of a query); queries: of a path;
        fit_seconds; predicted and measured: mean FLIP of the object with all materials' chosen models; noise: the same
        between two pictures of the truth; fit_error: the same with all materials' fields; below_fit_error: whether the
        tolerance is less than that, so that no model of the ladder may meet it; exceeds: whether `measured` is more
        than the tolerance; seconds: of the picture by `clock`; upgrades: how often the pictures asked for better models
        than were predicted; chosen_seeds, measured_seeds: of the pictures. *_field: the same of the fields everywhere.
        """
        with TemporaryDirectory() as folder:
            verifier = _Verifier(self, Path(folder))
            ns = {model.rung: nanoseconds(model.plugin(Path(folder))) for model in self.ladder[self.units[0]]}
            fields = {unit: len(models) - 1 for unit, models in self.ladder.items()}
            predicted_best = self.prediction.errors(self.models(fields))
            chosen_best, _ = verifier.measure(fields, CHOOSING)
            fit_error, field_seconds = verifier.measure(fields, REPORTING)
            rows = []
            for tolerance in self.progress(self.settings["tolerances"]):
                chosen, predicted = choose(self.prediction, self.ladder, self.errors, limits(tolerance, predicted_best))
                allowed, upgrades = limits(tolerance, chosen_best), 0
                while True:
                    worst = furthest(verifier.measure(chosen, CHOOSING)[0], allowed)
                    if worst is None or not upgrade(chosen, self.errors, worst):
                        break
                    upgrades += 1
                    predicted = self.prediction.errors(self.models(chosen))
                measured, seconds = verifier.measure(chosen, REPORTING)
                for unit, k in chosen.items():
                    model, name = self.ladder[unit][k], unit[0]
                    cost = model.rung, model.bytes, ns[model.rung], self.queries[unit], model.seconds
                    errors = predicted[name], measured[name], verifier.noise[name], fit_error[name]
                    marks = tolerance < fit_error[name], measured[name] > tolerance
                    truth = "table" if self.true[unit].rung == "table" else "field"
                    rows.append((tolerance, *self._names(unit), truth, *cost, *errors, *marks, seconds, upgrades))
        columns = ["tolerance", "object", "material", "truth", "rung", "bytes", "ns", "queries", "fit_seconds"]
        columns += ["predicted", "measured", "noise", "fit_error", "below_fit_error", "exceeds", "seconds", "upgrades"]
        table = pd.DataFrame(rows, columns=columns)
        seeds = {"chosen_seeds": _seeds(CHOOSING), "measured_seeds": _seeds(REPORTING)}
        return table.assign(bytes_field=4 * SIZE, ns_field=ns[WIDEST], seconds_field=field_seconds, **seeds)

    def models(self, chosen):
        """Return {unit: material} of chosen positions in the ladder."""
        return {unit: self.ladder[unit][k].material for unit, k in chosen.items()}


class _Verifier:
    """Renders the scene with the true materials and with chosen ones, from the same random numbers.

    noise: {object: mean FLIP} between two pictures of the true ones, from other random numbers.
    """

    def __init__(self, selection, folder):
        self.selection, self.folder, self.found = selection, folder, {}
        composition = self._composition(selection.true)
        self.coverage = coverage(composition, selection.layout)
        self.pictures = {seed: self._timed(composition, seed) for seed in (CHOOSING, REPORTING, NOISE)}
        pair = (self.pictures[seed][0] for seed in (REPORTING, NOISE))
        self.noise = object_errors(flip(*pair), self.coverage)

    def measure(self, chosen, seed):
        """Return ({object: mean FLIP}, seconds of the picture by `clock`) of pictures of one seed."""
        key = seed, tuple(sorted(chosen.items()))
        if key not in self.found:
            models = {unit: self.selection.ladder[unit][k] for unit, k in chosen.items()}
            true, seconds = self.pictures[seed]
            if all(model is self.selection.true[unit] for unit, model in models.items()):
                return dict.fromkeys(self.coverage, 0.0), seconds
            picture, seconds = self._timed(self._composition(self.selection.true | models), seed)
            self.found[key] = object_errors(flip(true, picture), self.coverage), seconds
        return self.found[key]

    def _composition(self, models):
        return self.selection.composed(models, self.selection.settings["verify"]["width"], self.folder)

    def _timed(self, composition, seed):
        """Return the picture as shown, and the seconds by `clock` of its second half: the first compiles the kernel."""
        half = self.selection.settings["verify"]["samples"] // 2
        total = render(composition, half, seed)
        start = clock()
        total = total + render(composition, half, seed + 1)
        return shown(total / 2, self.selection.layout["exposure"]), 2 * (clock() - start)


def _seeds(first):
    return f"{first} {first + 1}"


def _error(material, pool, k):
    found = material.eval(*(axis[k] for axis in pool.angles))
    return float(query_error(found, pool.values[k], pool.floor[k]))


def layout_materials(layout, materials):
    """Return {unit: (name, weights (675,))} of a layout, found in a Materials."""
    return {unit: materials.find(name) for unit, name in units(layout).items()}
