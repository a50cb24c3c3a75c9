"""What a Synthesiser asks of a request before it encodes anything."""

import pytest
import torch
from torch.nn.functional import normalize

from neumat.conditions.descriptions import Descriptions
from neumat.conditions.synthesis import Synthesiser
from neumat.errors import NeumatError
from neumat.fields.layout import SIZE
from neumat.render.sphere import FrozenSphere


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


def lambert(*albedos):
    """Return the weights (n, 675) of fields that reflect evenly, exactly."""
    weights = torch.zeros(len(albedos), SIZE)
    weights[:, -3:] = torch.log1p(torch.tensor(albedos) / torch.pi)
    return weights


def test_of_its_candidates_each_request_gets_the_one_whose_picture_fits():
    """Embeddings are the pictures' mean colours."""
    synthesiser = Synthesiser.__new__(Synthesiser)
    synthesiser.camera = FrozenSphere(48, 16, 32)
    synthesiser.images = lambda pictures: normalize(pictures.float().mean((1, 2)), dim=1)
    red, green, blue = (0.5, 0.05, 0.05), (0.05, 0.5, 0.05), (0.05, 0.05, 0.5)
    weights = lambert(red, green, blue, blue, red, green)
    asked = normalize(torch.tensor([red, green]), dim=1).repeat_interleave(3, 0)
    assert torch.equal(synthesiser.best(weights, {"text": asked}, 3), lambert(red, green))
    assert torch.equal(synthesiser.best(weights, {"image": asked[:1]}, 3), lambert(red, red))
    assert torch.equal(synthesiser.best(weights, {"type": torch.ones(1, 1)}, 3), lambert(red, blue))


def test_what_is_called_as_the_text_says_wins_where_pictures_say_nothing(toy):
    synthesiser = Synthesiser.__new__(Synthesiser)
    synthesiser.camera = FrozenSphere(48, 16, 32)
    synthesiser.images = lambda pictures: torch.ones(len(pictures), 1)
    synthesiser.descriptions = Descriptions(toy())
    red, green, blue = (0.5, 0.05, 0.05), (0.05, 0.5, 0.05), (0.05, 0.05, 0.5)
    weights = lambert(red, green, blue, blue, red, green)
    for text, expected in (("red thing", red), ("a matte blue thing", blue), ("green", green)):
        found = synthesiser.best(weights, {"text": torch.ones(1, 1)}, 3, toy().encode_text([text]))
        assert torch.equal(found, lambert(expected, expected))
