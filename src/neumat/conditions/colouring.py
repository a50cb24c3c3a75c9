"""Candidates in the colours of their requests, and what is told where one is missed."""

import logging

import torch

from neumat.conditions.appearance import gains, rendered_appearance
from neumat.conditions.choice import coloured, off_colour
from neumat.conditions.ranges import STEP, colours_within, linear_rgb, seen
from neumat.conditions.recolouring import own_colours, recoloured
from neumat.fields.validity import physical
from neumat.metrics.appearance import appearance

MISSED = 0.1  # of `choice.off_colour`, beyond which a colour is told to be missed


def within(weights, wanted):
    """Return candidates (r, m, 675), those outside of the colours of ranges `wanted` (r, SIZE) in one within."""
    fields, wanted = weights.flatten(0, 1), wanted.repeat_interleave(weights.shape[1], 0)
    looks = appearance(fields)
    positions = seen(looks)
    off = off_colour(positions, wanted).nonzero()[:, 0]
    return _changed(fields, looks, off, linear_rgb(colours_within(positions[off], wanted[off]))).view_as(weights)


def as_shown(weights, shown):
    """Return candidates (r, m, 675) in the colours of pictures `shown` (r, p), see `appearance.rendered_appearance`."""
    fields = weights.flatten(0, 1)
    looks = appearance(fields)
    gain = gains(rendered_appearance(fields), shown.repeat_interleave(weights.shape[1], 0))
    return _changed(fields, looks, torch.arange(len(fields)), own_colours(looks) * gain).view_as(weights)


def tell_missed(weights, wanted):
    """Warn where the colours of ranges `wanted` (r, SIZE) or (1, SIZE) are missed by weights (r, n, 675)."""
    if coloured(wanted).any():
        positions = seen(appearance(weights.flatten(0, 1))).view(*weights.shape[:2], -1)
        off = off_colour(positions, wanted[:, None])
        if count := int((off > MISSED).sum()):
            found = count, off.numel(), STEP * off.max()
            logging.warning("colour: %d of %d materials miss it, by up to %.0f (CIELAB)", *found)


def _changed(fields, looks, rows, colours):
    """Return fields (m, 675), the `rows` (k,) of them in other colours (k, 3), unless one is no BRDF then."""
    if not len(rows):
        return fields
    made, fields = recoloured(fields[rows], looks.iloc[rows.numpy()], colours), fields.clone()
    good = physical(made)
    fields[rows[good]] = made[good]
    return fields
