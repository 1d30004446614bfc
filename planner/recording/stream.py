"""From logged entities to a file."""

import uuid
from collections.abc import Callable
from pathlib import Path

import numpy as np
import rerun as rr

from boom_model.arrays import Array
from planner.files import replacing


def save(path: str | Path, name: str, log: Callable[[rr.RecordingStream], None]) -> None:
    """Writes the recording of that name, with what `log` puts in.

    Raises:
        InputError: the file cannot be written; an old one is left as it was.
    """
    with replacing(path) as temporary:
        Path(temporary).write_bytes(_encoded(name, log))


def time_column(t: Array) -> rr.TimeColumn:
    """Times (n,) [s] on the timeline "t"."""
    return rr.TimeColumn("t", duration=np.rint(t * 1e9).astype("timedelta64[ns]"))


def log_markdown(recording: rr.RecordingStream, entity: str, text: str) -> None:
    """A text that does not change."""
    recording.log(entity, rr.TextDocument(text, media_type="text/markdown"), static=True)


def log_png(recording: rr.RecordingStream, entity: str, png: bytes) -> None:
    """A picture that does not change."""
    recording.log(entity, rr.EncodedImage(contents=png, media_type="image/png"), static=True)


def _encoded(name: str, log: Callable[[rr.RecordingStream], None]) -> bytes:
    """The whole .rrd.

    It is put together in memory: once a write fails, as on a full disk, Rerun's own file sink (0.41) waits for ever. Each
    recording has an id of its own, as the viewer would merge two that share one.
    """
    strict = rr.strict_mode()
    rr.set_strict_mode(True)  # a misuse of Rerun raises, and is not a line in a log
    try:
        with rr.RecordingStream("boom", recording_id=uuid.uuid4()) as recording:
            memory = recording.memory_recording()
            recording.send_recording_name(name)
            log(recording)
        return memory.drain_as_bytes()
    finally:
        rr.set_strict_mode(strict)
