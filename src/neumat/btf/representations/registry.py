"""Every representation by the name that configs, files and tables use."""

from safetensors import safe_open

from neumat.btf.representations.linear import Pca, SphericalHarmonics
from neumat.btf.representations.variants import Biplane, Mean, NeuMip, Ours, TriplePlane
from neumat.configured import configured
from neumat.errors import NeumatError
from neumat.files import reading

REPRESENTATIONS = {
    "ours": Ours,
    "triple-plane": TriplePlane,
    "biplane": Biplane,
    "neumip": NeuMip,
    "pca": Pca,
    "sh": SphericalHarmonics,
    "mean": Mean,
}


def make(name, config=None):
    """Return the unfitted representation `name` with the hyperparameters `config` (dict) in place of its defaults.

    Raises NeumatError for an unknown name or hyperparameter.
    """
    return configured(REPRESENTATIONS, "representation", name, config)


def load_representation(path):
    """Return the representation in a file that its `save` wrote, whichever it is; raises NeumatError for another."""
    with reading(path, "a saved representation"), safe_open(path, "pt") as file:
        model = (file.metadata() or {}).get("model")
    classes = {each.__name__: each for each in REPRESENTATIONS.values()}
    if model not in classes:
        raise NeumatError(path, f"a saved representation: one of {', '.join(classes)}", model)
    return classes[model].load(path)
