"""The base of all errors."""


class DrinksimError(ValueError):
    """An input that cannot be used, or a computation that cannot go on.

    The message names culprit, value and remedy.
    """
