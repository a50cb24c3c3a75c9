"""The dense set: its recipe, from the sources' fields, and the fits."""

from neumat.augment.manifest import source_rows
from neumat.fields.validity import ANGLES, directional_albedos


def source_albedos(manifest, fitted):
    """Return the largest directional albedo (N,) float32 of each source of the manifest, over channels and the light's
    ANGLES, by their fields in the NeuMerl `fitted`."""
    weights = fitted.weights[source_rows(manifest)["index"].to_numpy().copy()]
    return directional_albedos(weights, ANGLES).amax((1, 2)).numpy()
