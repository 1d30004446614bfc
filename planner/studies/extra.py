"""Libraries of the extra `boom[study]`, imported where they are used."""

from importlib import import_module
from typing import Any

from boom_model.errors import InputError


def required(module: str) -> Any:
    """Import a module of the extra.

    Raises:
        InputError: it is not installed; the message says how to install it.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        raise InputError(
            f"this study needs the extra study ({error.name} is missing): run pip install '.[study]' in the folder of boom"
        ) from None
