"""Every generative model by the name that configs, files and tables use."""

from neumat.configured import configured
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
    return configured(METHODS, "method", name, config)
