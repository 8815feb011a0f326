"""The base of all errors about a user's input."""


class DrinksimError(ValueError):
    """An input or a setting that cannot be used; the message names culprit, value and remedy."""
