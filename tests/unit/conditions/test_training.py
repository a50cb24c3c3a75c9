import torch
from torch.nn.functional import normalize

from neumat.conditions.training import landmarks


def test_landmarks_are_captions_and_leave_none_far_from_them():
    centres = normalize(torch.randn(8, 16, generator=torch.Generator().manual_seed(0)))
    captions = normalize(centres.repeat_interleave(10, 0) + 0.01 * torch.randn(80, 16))
    kept = normalize(landmarks(captions, 8).float())
    assert kept.shape == (8, 16)
    near = captions @ kept.T
    assert near.amax(0).min() > 0.999  # each is one, but for rounding
    assert near.amax(1).min() > 0.98  # one of each cluster
    assert len(landmarks(captions[:5], 8)) == 5
