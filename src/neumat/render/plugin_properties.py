"""Properties of the BSDF plugins, as Mitsuba hands them over: what is missing or wrong ends in one line."""

import mitsuba as mi
import torch

from neumat.brdf.merl import read_merl
from neumat.brdf.table import Table
from neumat.errors import NeumatError
from neumat.export import find_material, read_material
from neumat.fields.layout import SIZE, widths_of


def text(properties, plugin, key):
    """Return the property `key`, a text. Raises NeumatError where there is none, and for another type."""
    if key not in properties:
        raise NeumatError(plugin, f"the property {key}", "none")
    value = properties[key]
    if not isinstance(value, str):
        raise NeumatError(f"{plugin}: {key}", "a text", repr(value))
    return value


def flag(properties, plugin, key):
    """Return the property `key`, true or false (the default), also where it is a text. Raises NeumatError for more."""
    value = properties.get(key, False)
    named = {"true": True, "false": False}.get(value.strip().lower()) if isinstance(value, str) else value
    if not isinstance(named, bool):
        raise NeumatError(f"{plugin}: {key}", "true or false", repr(value))
    return named


def numbers(properties, plugin, key, expected):
    """Return the numbers, float64, of a text property. Raises NeumatError where there are none."""
    try:
        return torch.tensor([float(number) for number in text(properties, plugin, key).split()], dtype=torch.float64)
    except ValueError as error:
        raise NeumatError(f"{plugin}: {key}", f"{expected} numbers", error) from error


def parameters(properties, plugin, count, alpha):
    """Return the numbers (count,), float64, of an analytic plugin, of which those at `alpha` are roughnesses.

    Raises NeumatError for another number of them, what is not finite, and roughnesses of 0 or less.
    """
    found, what = numbers(properties, plugin, "parameters", count), f"{plugin}: parameters"
    if len(found) != count or not found.isfinite().all():
        raise NeumatError(what, f"{count} finite numbers", f"{len(found)}, or NaN or infinite ones")
    if not (found[alpha] > 0).all():
        raise NeumatError(what, "alpha > 0", f"{found[alpha].min():g}")
    return found


def path_of(properties, plugin):
    """Return the property `filename`, found as Mitsuba finds files: beside the scene's file, or on its search path."""
    return str(mi.file_resolver().resolve(text(properties, plugin, "filename")))


def material_of(properties):
    """Return the weights (n,) or the Table that the properties of an `nbrdf` name.

    Raises NeumatError for a bad file, and for a number of weights that no field has.
    """
    given = [key for key in ("filename", "weights") if key in properties]
    if len(given) != 1:
        raise NeumatError("nbrdf", "the property filename or weights", "both" if given else "neither")
    if given == ["weights"]:
        weights = numbers(properties, "nbrdf", "weights", SIZE).float()
        widths_of(len(weights))
        return weights
    if "material" in properties:
        return find_material(path_of(properties, "nbrdf"), text(properties, "nbrdf", "material"))
    return read_material(path_of(properties, "nbrdf"))


def table_of(properties):
    """Return the Table that the properties of a `merl` name. Raises NeumatError for a bad file."""
    return Table(read_merl(path_of(properties, "merl")))
