"""Writing logged entities to a file."""

import shlex
import sys
import uuid
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr

from boom_model import Boom
from boom_model.arrays import Array
from planner.files import replacing
from planner.reports.report import Report

_COMMANDS = ("boom", "__main__.py")
_VERSIONS = ("boom", "numpy", "rerun-sdk", "ruckig", "toppra")


def save(path: str | Path, name: str, log: Callable[[rr.RecordingStream], None]) -> None:
    """Write the recording of that name with the content that `log` adds.

    Raises:
        InputError: the file cannot be written. An existing file is left unchanged.
    """
    with replacing(path) as temporary:
        Path(temporary).write_bytes(_encoded(name, log))


def time_column(t: Array) -> rr.TimeColumn:
    """Return times (n,) [s] on the timeline "t"."""
    return rr.TimeColumn("t", duration=np.rint(t * 1e9).astype("timedelta64[ns]"))


def log_markdown(recording: rr.RecordingStream, entity: str, text: str) -> None:
    """Log a static Markdown document."""
    recording.log(entity, rr.TextDocument(text, media_type="text/markdown"), static=True)


def log_png(recording: rr.RecordingStream, entity: str, png: bytes) -> None:
    """Log a static picture."""
    recording.log(entity, rr.EncodedImage(contents=png, media_type="image/png"), static=True)


def log_properties(recording: rr.RecordingStream, boom: Boom, report: Report) -> None:
    """Log what was asked and found as recording properties, with the command and the versions."""
    found: dict[str, Any] = {
        "verdict": str(report.verdict),
        "profile": report.profile,
        "duration_s": report.duration,
        "payload_kg": boom.payload.mass,
        "boom": boom.name,
        "command": shlex.join(["boom", *sys.argv[1:]]) if Path(sys.argv[0]).name in _COMMANDS else "from Python",
        "versions": ", ".join(f"{name} {metadata.version(name)}" for name in _VERSIONS),
    }
    recording.send_property("boom", rr.AnyValues(**found))


def _encoded(name: str, log: Callable[[rr.RecordingStream], None]) -> bytes:
    """Return the whole .rrd file.

    It is built in memory, because Rerun's own file sink (0.41) waits for ever once a write fails,
    for example on a full disk. Each recording has its own id, because the viewer merges recordings
    with equal ids.
    """
    strict = rr.strict_mode()
    rr.set_strict_mode(True)  # a misuse of Rerun raises an exception instead of writing a log message
    try:
        with rr.RecordingStream("boom", recording_id=uuid.uuid4()) as recording:
            memory = recording.memory_recording()
            recording.send_recording_name(name)
            log(recording)
        return memory.drain_as_bytes()
    finally:
        rr.set_strict_mode(strict)
