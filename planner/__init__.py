"""From targets to motions that have been checked, and to what people keep of them: reports, recordings, CSV.

The names stand in `planner.api`. They are imported with the first of them, so that the command answers to a signal before.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from planner.api import *  # noqa: F403


def __getattr__(name: str) -> object:
    if name == "__all__" or not name.startswith("_"):
        return getattr(import_module("planner.api"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
