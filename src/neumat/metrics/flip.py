"""What of an error can be seen: FLIP between two pictures as they are shown (Andersson et al. 2020)."""

import flip_evaluator

PIXELS_PER_DEGREE = 67.02  # FLIP's own default: a 0.7 m wide monitor of 3840 pixels, seen from 0.7 m


def flip(reference, test, enlarged=1.0):
    """Return the FLIP map (h, w), 0..1, of two 8-bit sRGB pictures (h, w, 3).

    enlarged: how many pixels of the picture that is meant lie along one of these.
    """
    parameters = {"ppd": PIXELS_PER_DEGREE / enlarged}
    pictures = ((picture / 255).astype("float32") for picture in (reference, test))
    found, _, _ = flip_evaluator.evaluate(*pictures, "LDR", applyMagma=False, parameters=parameters)
    return found[..., 0]
