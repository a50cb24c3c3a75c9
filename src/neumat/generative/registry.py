"""Every generative model by the name that configs, files and tables use."""

from neumat.errors import NeumatError
from neumat.generative.baselines import (
    Copies,
    Interpolations,
    Merl100,
    NoisyCopies,
    PcaA,
    PcaN,
    VaeA,
    VaeN,
)
from neumat.generative.hyperdiffusion import HyperDiffusion

METHODS = {
    "hyperdiffusion": HyperDiffusion,
    "pca-a": PcaA,
    "pca-n": PcaN,
    "vae-a": VaeA,
    "vae-n": VaeN,
    "merl100": Merl100,
    "copies": Copies,
    "noisy-copies": NoisyCopies,
    "interpolations": Interpolations,
}


def make(name, config=None):
    """Return the unfitted model `name` with the hyperparameters `config` (dict) in place of its defaults.

    Raises NeumatError for an unknown name or hyperparameter.
    """
    if name not in METHODS:
        raise NeumatError("method", f"one of {', '.join(METHODS)}", name)
    return METHODS[name].from_config(config or {})
