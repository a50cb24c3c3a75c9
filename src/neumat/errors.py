"""The one exception that a user's mistake raises."""


class NeumatError(Exception):
    """A mistake in the user's data or config: one line that names the place, what was expected, what was found."""

    def __init__(self, where, expected, found):
        super().__init__(f"{where}: expected {expected}; found {found}")
