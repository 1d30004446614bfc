"""Recordings read back."""

from pathlib import Path
from typing import Any

from rerun.chunk import RrdReader


def recorded_rows(path: Path, entity: str, component: str, static: bool = False) -> list[Any]:
    """A component's rows, in order of time."""
    stream = RrdReader(path).stream().filter(content=entity, is_static=static, components=component)
    batches = [chunk.to_record_batch() for chunk in stream.to_chunks()]
    if not static:
        batches.sort(key=lambda batch: batch.column("t")[0].value)
    return [row for batch in batches for row in batch.column(component).to_pylist()]


def recorded_entities(path: Path) -> set[str]:
    """Paths of all entities."""
    return set(RrdReader(path).store().schema().entity_paths())
