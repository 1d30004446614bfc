"""From targets to motions that have been checked, and to what people keep of them: reports, recordings, CSV.

The names stand in `planner.api`, and are imported when the first of them is used: the command imports this package before it
can handle a signal, so even `typing` would take too long here.
"""

TYPE_CHECKING = False  # as in `typing`; a type checker takes it for True

if TYPE_CHECKING:
    from planner.api import *  # noqa: F403


def __getattr__(name: str) -> object:
    if name != "__all__" and name.startswith("_"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module("planner.api"), name)
