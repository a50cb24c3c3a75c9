"""The contract of a generative model of materials: hyperparameters in __init__, data only in fit."""

import abc
import json
from dataclasses import asdict, dataclass

import numpy as np
import torch

from neumat.checkpoints import read_checkpoint, write_checkpoint
from neumat.configured import Configured
from neumat.errors import NeumatError
from neumat.fields.layout import SIZE

SCHEMA = "4"


@dataclass(frozen=True)
class Dataset:
    """The materials on the training side of one protocol.

    weights (n, 675) float32 tensor; base (n,) index of the material before its channels were permuted;
    permutation (n,) index into PERMUTATIONS; is_source (n,) bool: measured, not blended. The models of tables
    also need coefficients (n, 3, m) float32, each channel as a combination of the m columns of the sources, and
    gram (m, m) float64, the inner products of those columns. Raises NeumatError where a shape does not fit.
    """

    weights: torch.Tensor
    base: np.ndarray
    permutation: np.ndarray
    is_source: np.ndarray
    coefficients: np.ndarray | None = None
    gram: np.ndarray | None = None

    def __post_init__(self):
        n = len(self.weights)
        expected = {"weights": (n, SIZE), "base": (n,), "permutation": (n,), "is_source": (n,)}
        if self.coefficients is not None and self.gram is not None:
            m = len(self.gram)
            expected |= {"coefficients": (n, 3, m), "gram": (m, m)}
        for name, shape in expected.items():
            if tuple(getattr(self, name).shape) != shape:
                raise NeumatError(f"dataset.{name}", f"shape {shape}", tuple(getattr(self, name).shape))
        if n < 2:
            raise NeumatError("dataset", "at least 2 materials", n)
        if not torch.isfinite(self.weights).all():
            raise NeumatError("dataset.weights", "finite numbers", "NaN or infinity")

    def subset(self, mask):
        """Return the Dataset of the materials where the bool array `mask` (n,) holds."""
        coefficients = None if self.coefficients is None else self.coefficients[mask]
        return Dataset(
            self.weights[torch.as_tensor(mask)],
            self.base[mask],
            self.permutation[mask],
            self.is_source[mask],
            coefficients,
            self.gram,
        )


@dataclass(kw_only=True)
class GenerativeModel(Configured, abc.ABC):
    """One method. Its dataclass fields are its hyperparameters; what `fit` learns is a dict of tensors, `state`.

    kind: "weights", where samples are (n, 675), or "table", where they are (n, 3, m) coefficients of the source
    columns. stride: the grid on which the Gram matrix of a table model is taken: every entry, or every second one
    along each axis.
    """

    kind = "weights"
    stride = 1

    def fit(self, dataset, seed, progress=None, checkpoint=None):
        """Learn the distribution of `dataset` and return self.

        progress: None, or a callable that wraps an iterable of known length (tqdm). checkpoint: where an iterative
        method keeps its state, and resumes from; removed once fitted. Raises NeumatError where a table model gets
        no tables.
        """
        if self.kind == "table" and (dataset.coefficients is None or dataset.gram is None):
            raise NeumatError(type(self).__name__, "a dataset with coefficients and gram", "none")
        self.state = self._fit(dataset, seed, progress or (lambda steps: steps), checkpoint)
        return self

    def sample(self, n, seed):
        """Return n new materials, float32: (n, 675), or (n, 3, m) where kind is "table"."""
        if not hasattr(self, "state"):
            raise NeumatError(type(self).__name__, "a fitted model", "none")
        if n < 1:
            raise NeumatError("n", "at least 1 sample", n)
        return np.asarray(self._sample(n, seed), dtype=np.float32)

    @abc.abstractmethod
    def _fit(self, dataset, seed, progress, checkpoint): ...

    @abc.abstractmethod
    def _sample(self, n, seed): ...

    def save(self, path):
        """Write the model as safetensors, its class and config as JSON in the metadata."""
        metadata = {"schema": SCHEMA, "model": type(self).__name__, "config": json.dumps(asdict(self))}
        write_checkpoint(path, metadata, self.state)

    @classmethod
    def load(cls, path):
        """Read a model that `save` wrote. Raises NeumatError for another file, class or schema version."""
        metadata, state = read_checkpoint(path, "a saved generative model", SCHEMA, cls.__name__)
        model = cls(**json.loads(metadata["config"]))
        model.state = state
        return model
