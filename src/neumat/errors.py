"""The one exception that a user's mistake raises."""


class NeumatError(Exception):
    """A mistake in the user's data or config: one line that names the place, what was expected, what was found."""

    def __init__(self, where, expected, found):
        # What is found may be a library's exception, whose message has several lines.
        super().__init__(" ".join(f"{where}: expected {expected}; found {found}".splitlines()))
