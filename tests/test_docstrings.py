"""The public API is documented, typed for those who import it, and its examples are true."""

import doctest
import importlib
import inspect
import pkgutil
from dataclasses import is_dataclass
from pathlib import Path

import pytest

import boom_model
import planner

MODULES = [
    importlib.import_module(found.name)
    for package in (boom_model, planner)
    for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}.")
]


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.__name__)
def test_examples_in_docstrings_are_true(module):
    assert doctest.testmod(module).failed == 0


def test_there_are_examples():
    assert sum(doctest.testmod(module).attempted for module in MODULES) >= 8


@pytest.mark.parametrize("package", [boom_model, planner], ids=lambda package: package.__name__)
def test_every_public_name_has_a_docstring_and_is_marked_typed(package):
    assert (Path(package.__path__[0]) / "py.typed").is_file()
    for name in package.__all__:
        public = getattr(package, name)
        if not (inspect.isclass(public) or inspect.isfunction(public)):
            continue
        assert public.__doc__, name
        if is_dataclass(public):
            assert not public.__doc__.startswith(f"{name}("), name  # what a dataclass writes where nobody did


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.__name__)
def test_every_module_and_public_function_says_what_it_is(module):
    if module.__file__.endswith("__init__.py") and not module.__doc__:
        return
    assert module.__doc__
    for name, function in inspect.getmembers(module, inspect.isfunction):
        if function.__module__ == module.__name__ and not name.startswith("_"):
            assert function.__doc__, f"{module.__name__}.{name}"
