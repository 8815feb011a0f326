"""The base of every error that tells a user what to mend."""


class DrinksimError(ValueError):
    """An input or a setting that cannot be used; its text names culprit, value and remedy."""
