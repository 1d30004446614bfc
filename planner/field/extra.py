"""Libraries of the extra `field`, imported when they are first needed."""

from importlib import import_module
from types import ModuleType

from boom_model import InputError


def library(name: str) -> ModuleType:
    """Return a library of the extra.

    Raises:
        InputError: it is not installed; says how to install it.
    """
    try:
        return import_module(name)
    except ModuleNotFoundError:
        raise InputError(
            f"this needs {name.partition('.')[0]} of the extra field: run pip install '.[field]' in the folder of boom"
        ) from None
