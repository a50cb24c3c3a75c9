"""Saved models: safetensors with the class, the schema version and the config that made them, and a digest of all."""

import hashlib
import json

import torch
from safetensors import safe_open
from safetensors.torch import save_file

from neumat.errors import NeumatError
from neumat.files import atomic_path, reading


def read_checkpoint(path, what, schema, model):
    """Return (metadata, tensors by name) of the safetensors file in which `model`, a class name, was saved.

    what: the file in words. Raises NeumatError for another file, class or schema version, and where metadata or tensors
    are not what `write_checkpoint` wrote, whatever was changed.
    """
    with reading(path, what), safe_open(path, "pt") as file:
        metadata = file.metadata() or {}
        tensors = {name: file.get_tensor(name) for name in file.keys()}
    for key, expected in (("model", model), ("schema", schema)):
        if metadata.get(key) != expected:
            raise NeumatError(path, f"{key} {expected}", metadata.get(key))
    if metadata.pop("digest", None) != digest(metadata, tensors):
        raise NeumatError(path, f"{what} as it was written", "other contents")
    return metadata, tensors


def write_checkpoint(path, metadata, tensors):
    """Write {name: tensor} and {text: text} as safetensors, with a digest of both in the metadata."""
    tensors = {name: tensor.contiguous() for name, tensor in tensors.items()}
    with atomic_path(path) as temporary:
        save_file(tensors, temporary, metadata | {"digest": digest(metadata, tensors)})


def digest(metadata, tensors):
    """Return the SHA-256 of metadata and tensors, in hexadecimal."""
    found = hashlib.sha256(json.dumps(metadata, sort_keys=True).encode())
    for name, tensor in sorted(tensors.items()):
        found.update(f"{name} {tensor.dtype} {tuple(tensor.shape)}".encode())
        found.update(tensor.contiguous().reshape(-1).view(torch.uint8).numpy().data)
    return found.hexdigest()
