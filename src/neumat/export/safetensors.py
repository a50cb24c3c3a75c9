"""Fields as `.safetensors`: the six arrays, and in the metadata all that is needed to evaluate them."""

from safetensors import SafetensorError
from safetensors.numpy import load_file, save_file

from neumat.errors import NeumatError
from neumat.export.parts import join, split
from neumat.files import atomic_path

MEMBERS = ("W1", "b1", "W2", "b2", "W3", "b3")


def write_safetensors(path, weights, metadata):
    """Write the field (675,) with `metadata` {text: text}."""
    with atomic_path(path) as temporary:
        save_file(dict(zip(MEMBERS, split(weights), strict=True)), temporary, metadata)


def read_safetensors(path):
    """Return the field (675,).

    Raises NeumatError for a missing, damaged or foreign file, a missing member, and where `parts.join` does.
    """
    try:
        tensors = load_file(path)
    except (SafetensorError, OSError) as error:
        raise NeumatError(path, "a .safetensors file", "a damaged or foreign file") from error
    for member in MEMBERS:
        if member not in tensors:
            raise NeumatError(path, f"the members {', '.join(MEMBERS)}", f"no {member}")
    return join(path, {member: tensors[member] for member in MEMBERS})
