"""The exception of this package."""


class RioTError(Exception):
    """A fault of the input or of a run, told in one line."""
