"""What a Synthesiser asks of a request before it encodes anything."""

import pytest
import torch

from neumat.conditions.synthesis import Synthesiser
from neumat.errors import NeumatError


@pytest.mark.parametrize(
    ("request_", "expected"),
    [
        ({"text": ""}, "an empty text"),
        ({"text": " \t\n"}, "an empty text"),
        ({"text": 5}, "found 5"),
        ({"text": "caf\udce9"}, "Unicode"),
        ({"image": torch.rand(32, 32, 3)}, "uint8"),
        ({"image": torch.zeros(32, 32, 3, dtype=torch.uint8)}, "one even colour"),
        ({"type": "wombat"}, "one of felt"),
    ],
)
def test_what_is_no_request_ends_in_one_line(request_, expected):
    synthesiser = Synthesiser.__new__(Synthesiser)
    synthesiser.types = ["felt"]
    with pytest.raises(NeumatError, match=expected) as error:
        synthesiser.request(**request_)
    str(error.value).encode()  # can be printed
    assert "\n" not in str(error.value)
