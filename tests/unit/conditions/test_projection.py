import pytest
import torch
from torch.nn.functional import normalize

from neumat.conditions.projection import SIZE, Augmentation, Projection
from neumat.errors import NeumatError


def test_projection_augmentation_drops_what_the_captions_do_not_span():
    g = torch.Generator().manual_seed(0)
    basis = torch.linalg.qr(torch.randn(16, 5, generator=g))[0].T
    captions = normalize(basis[0] + 0.3 * torch.randn(200, 4, generator=g) @ basis[1:])
    outside = torch.linalg.svd(basis, full_matrices=True)[2][-1]
    text = captions[:1]
    augmentation = Augmentation.fit(captions, 0.0)
    clean = augmentation(text)
    assert (clean @ text.T).item() > 0.99  # what the captions say stays
    assert torch.allclose(augmentation(text + 0.5 * outside), clean, atol=1e-4)
    away = (Augmentation.fit(captions, 2.0)(text) - captions.mean(0)).norm()
    assert away > (clean - captions.mean(0)).norm()  # and is amplified
    assert torch.equal(Augmentation.fit(captions, -1.0)(text + outside), text + outside)  # or left as it is


@pytest.fixture(scope="module")
def fitted():
    """60 materials of 6 kinds; features that show the kind, apart from noise."""
    g = torch.Generator().manual_seed(1)
    kind = torch.arange(60) % 6
    words, looks = torch.randn(6, 20, generator=g), torch.randn(6, 30, generator=g)
    texts = normalize(words, dim=1)[kind][:, None].expand(-1, 3, -1)
    images = looks[kind][:, None] + 0.3 * torch.randn(60, 4, 30, generator=g)
    projection = Projection.fit("toy", texts, images, 0.0, 150, 30, 0, iter)
    return projection, texts, images, kind


def test_texts_find_the_pictures_they_describe(fitted):
    projection, texts, images, kind = fitted
    said, seen = projection.text(texts[:6, 0]), projection.image(images[:, 0])
    assert said.shape == (6, SIZE) and torch.allclose(said.norm(dim=1), torch.ones(6), atol=1e-5)
    assert (kind[(said @ seen.T).argmax(1)] == torch.arange(6)).all()


def test_a_saved_projection_is_the_same(fitted):
    projection, texts, images, _ = fitted
    again = Projection("toy", dict(projection.state))
    assert torch.equal(again.text(texts), projection.text(texts))
    assert torch.equal(again.image(images), projection.image(images))
    with pytest.raises(NeumatError, match="image features"):
        projection.image(images[..., :7])
