"""Type of an iteration that can show progress."""

from collections.abc import Callable, Iterable
from typing import Any

Track = Callable[[list[Any]], Iterable[Any]]
"""Iterates over the steps of a job, as `iter` does, and may show progress."""
