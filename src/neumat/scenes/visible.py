"""The visible error of each object of a scene."""


def object_errors(errors, coverage):
    """Return {object: mean of a FLIP map (h, w) over its pixels}, of {object: share (h, w) of each pixel}.

    An object that is not in the picture has the error 0.
    """
    return {
        name: float((errors * share).sum() / share.sum()) if share.sum() > 0 else 0.0
        for name, share in coverage.items()
    }
