"""The exceptions of this package."""


class RioTError(Exception):
    """A fault of the input or of a run, told in one line."""


class UsageError(RioTError):
    """A fault of the command line."""
