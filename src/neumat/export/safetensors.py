"""Fields as `.safetensors`: the six arrays, and in the metadata all that is needed to evaluate them."""

from safetensors import safe_open
from safetensors.numpy import save_file

from neumat.errors import NeumatError
from neumat.export.parts import join, split
from neumat.files import atomic_path, reading

MEMBERS = ("W1", "b1", "W2", "b2", "W3", "b3")


def write_safetensors(path, weights, metadata):
    """Write the field (675,) with `metadata` {text: text}."""
    with atomic_path(path) as temporary:
        save_file(dict(zip(MEMBERS, split(weights), strict=True)), temporary, metadata)


def read_safetensors(path):
    """Return the field (675,).

    Raises NeumatError for a missing, damaged or foreign file, a missing member, and where `parts.join` does.
    """
    with reading(path, "a .safetensors file"), safe_open(path, "pt") as file:  # NumPy has no bfloat16
        missing = set(MEMBERS) - set(file.keys())
        if missing:
            raise NeumatError(path, f"the members {', '.join(MEMBERS)}", f"no {min(missing)}")
        tensors = {member: file.get_tensor(member) for member in MEMBERS}
    # What is not of a floating type stays so, and is refused.
    parts = {name: tensor.double() if tensor.is_floating_point() else tensor for name, tensor in tensors.items()}
    return join(path, {name: part.numpy() for name, part in parts.items()})
