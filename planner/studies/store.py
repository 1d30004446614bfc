"""Dataset of a study: finished chunks as files beside it, joined at the end as one Parquet file."""

import fcntl
import hashlib
import json
import pickle
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

from boom_model.errors import InputError
from planner.files import replacing
from planner.studies.sample import Points
from planner.studies.study import Study

if TYPE_CHECKING:
    import pyarrow as pa

_LIBRARIES = ("boom", "numpy", "scipy", "toppra", "ruckig", "clarabel", "pyarrow")
_STATE = "study.json"
_GROUP = 8192
"""Rows of a row group of the dataset: few enough to be held in memory."""


class Store:
    """Finished chunks of a study, in the folder DATASET.parts.

    A chunk's file is whole or not there.
    """

    def __init__(self, dataset: str | Path, study: Study) -> None:
        """Args: dataset: the Parquet file that is to be written in the end."""
        self.study = study
        self.folder = Path(f"{dataset}.parts")
        self.chunks = -(-len(study.design) // study.chunk)

    @contextmanager
    def opened(self, resume: bool) -> Iterator[None]:
        """Hold the folder for this process alone.

        Args:
            resume: go on with the chunks that are there.

        Raises:
            InputError: there are chunks and `resume` is false, they are of another study or of
                other versions, another process is at work on them, or the folder cannot be made.
        """
        state = _state(self.study)
        try:
            self.folder.mkdir(exist_ok=True)
            with open(self.folder / _STATE, "a+", encoding="utf-8") as file:
                try:
                    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                except BlockingIOError:
                    raise InputError(f"{self.folder}: another run of this study is at work there") from None
                file.seek(0)
                self._agree(file.read(), state, resume)
                if not resume or not file.tell():
                    with replacing(self.folder / _STATE) as temporary:
                        Path(temporary).write_text(json.dumps(state, indent=1), encoding="utf-8")
                yield
        except OSError as error:
            raise InputError(f"{self.folder}: cannot be written: {error.strerror or error}") from None

    def _agree(self, text: str, state: dict[str, str], resume: bool) -> None:
        if not resume:
            if next(self.folder.glob("*.parquet"), None) is not None:
                raise InputError(f"{self.folder}: holds chunks of an earlier run; --resume goes on, removing it starts anew")
            return
        if not text:
            return
        try:
            found = json.loads(text)
        except ValueError:
            raise InputError(f"{self.folder / _STATE}: is not what a study wrote there") from None
        other = [name for name in state if found.get(name) != state[name]]
        if other:
            raise InputError(
                f"{self.folder}: its chunks are of another study; different: {', '.join(other)}; remove it to start anew"
            )

    def points(self, chunk: int) -> Points:
        """Return the points of a chunk."""
        first = chunk * self.study.chunk
        last = min(first + self.study.chunk, len(self.study.design))
        return [(i, self.study.design.point(i), self.study.design.values(i)) for i in range(first, last)]

    def missing(self) -> list[int]:
        """Return the chunks that are not finished, in order."""
        return [chunk for chunk in range(self.chunks) if not self._part(chunk).exists()]

    def write(self, chunk: int, table: "pa.Table") -> None:
        """Write a finished chunk.

        Raises:
            InputError: it cannot be written.
        """
        import pyarrow.parquet as pq

        with replacing(self._part(chunk)) as temporary:
            pq.write_table(table, temporary)

    def join(self, path: str | Path) -> None:
        """Write all chunks as one Parquet file.

        It depends on the study alone, not on the size of its chunks.

        Raises:
            InputError: it cannot be written.
        """
        import pyarrow as pa
        import pyarrow.parquet as pq

        parts = [self._part(chunk) for chunk in range(self.chunks)]
        whole = pa.unify_schemas([pq.read_schema(part).remove_metadata() for part in parts], promote_options="permissive")
        whole = pa.schema([field if field.type != pa.null() else pa.field(field.name, pa.string()) for field in whole])
        whole = whole.with_metadata({"study": self.study.name, "question": self.study.question, "seed": str(self.study.seed)})
        try:
            with pq.ParquetWriter(path, whole) as writer:
                for group in _groups(_conforming(pq.read_table(part), whole) for part in parts):
                    writer.write_table(group)
        except OSError as error:
            raise InputError(f"{path}: cannot be written: {error.strerror or error}") from None

    def remove(self) -> None:
        """Remove the chunks, once they stand in the dataset."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def _part(self, chunk: int) -> Path:
        return self.folder / f"{chunk:07d}.parquet"


def _conforming(table: "pa.Table", schema: "pa.Schema") -> "pa.Table":
    """Return a table with the columns of a schema; those that it lacks are empty."""
    import pyarrow as pa

    known = set(table.column_names)
    columns = [
        table[field.name].cast(field.type) if field.name in known else pa.nulls(len(table), field.type) for field in schema
    ]
    return pa.table(columns, schema=schema)


def _groups(tables: "Iterable[pa.Table]") -> "Iterator[pa.Table]":
    """Yield the rows of tables of one schema in tables of _GROUP rows, and the rest."""
    import pyarrow as pa

    rest: pa.Table | None = None
    for table in tables:
        rest = table if rest is None else pa.concat_tables([rest, table])
        while len(rest) >= _GROUP:
            yield rest.slice(0, _GROUP).combine_chunks()
            rest = rest.slice(_GROUP)
    if rest is not None and len(rest):
        yield rest.combine_chunks()


def _state(study: Study) -> dict[str, str]:
    """Return what must be the same for two runs to give the same dataset."""
    digest = hashlib.sha256(json.dumps(vars(study.case.inputs), sort_keys=True, default=str).encode())
    digest.update(repr((study.case.factors, study.case.joints, study.case.step)).encode())
    points = hashlib.sha256(study.design.coordinates.tobytes() + pickle.dumps(study.design.points))
    return {
        "inputs and factors": digest.hexdigest(),
        "points": points.hexdigest(),
        "seed": str(study.seed),
        "chunk": str(study.chunk),
        **{f"version of {name}": version(name) for name in _LIBRARIES},
    }
