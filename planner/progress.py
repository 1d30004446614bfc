"""Iteration that may show how far it is."""

from collections.abc import Callable, Iterable
from typing import Any

Track = Callable[[list[Any]], Iterable[Any]]
"""Goes through the steps of a job, as `iter` does, and may show on the way how far it is."""
