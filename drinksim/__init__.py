"""A virtual consumer: how a package opening feels on the lips.

>>> import drinksim as ds
>>> ds.load_scenario("A38-F").contact.friction
1.0

This is all that is public. Names are imported from where they are made when they are first used, so
that ``import drinksim`` takes no time.
"""

from importlib import import_module as _import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from drinksim import fem as fem
    from drinksim.api import RecordingWarning as RecordingWarning
    from drinksim.api import convert as convert
    from drinksim.api import explore as explore
    from drinksim.api import report as report
    from drinksim.api import study as study
    from drinksim.values import Scenario as Scenario
    from drinksim.values import Solution as Solution
    from drinksim.values import library_names as library_names
    from drinksim.values import load_scenario as load_scenario
    from geometry2d.foundation.errors import DrinksimError as DrinksimError
    from mocap.motion.motion import Motion as Motion

    __version__: str

_MADE_IN = {
    "DrinksimError": "geometry2d.foundation.errors",
    "Motion": "mocap.motion.motion",
    "RecordingWarning": "drinksim.api",
    "Scenario": "drinksim.values",
    "Solution": "drinksim.values",
    "convert": "drinksim.api",
    "explore": "drinksim.api",
    "library_names": "drinksim.values",
    "load_scenario": "drinksim.values",
    "report": "drinksim.api",
    "study": "drinksim.api",
}

__all__ = [
    "DrinksimError",
    "Motion",
    "RecordingWarning",
    "Scenario",
    "Solution",
    "__version__",
    "convert",
    "explore",
    "fem",
    "library_names",
    "load_scenario",
    "report",
    "study",
]

if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        """Import a public name when it is first used."""
        if name == "__version__":
            value = _import_module("importlib.metadata").version("drinksim")
        elif name == "fem":
            value = _import_module("drinksim.fem")
        elif name in _MADE_IN:
            value = getattr(_import_module(_MADE_IN[name]), name)
        else:
            raise AttributeError(
                f"drinksim has no {name!r}: it has {', '.join(__all__)}", name=name
            )
        globals()[name] = value
        return value

    def __dir__() -> list[str]:
        """Return the public names."""
        return list(__all__)
