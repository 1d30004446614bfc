"""What the viewer itself makes of a recording, where it can run: poses by its own transform graph,
pictures, its log.

It runs where a Vulkan driver is found, be it one that draws in software. The poses are held against
the model by two readers: the file's everywhere, the viewer's where it runs.
"""

import io
import shutil
import socket
import sys
import sysconfig
from collections.abc import Callable
from glob import glob
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from rerun.chunk import RrdReader
from rerun.experimental import ViewerClient
from scipy.spatial.transform import Rotation

from boom_model import Boom, body_transforms
from boom_model.arrays import Array
from planner.planning import Move, plan
from planner.recording import write_recording

DRIVERS = [path for folder in ("/usr/share", "/usr/local/share", "/etc") for path in glob(f"{folder}/vulkan/icd.d/*.json")]
VIEWER_RUNS = sys.platform != "linux" or bool(DRIVERS)

Poses = dict[str, Array]
"""By frame, in "mount": (times, 4, 4)."""

TIMES = 10
PICTURES = (0, 5, 9)


def by_the_file(path: Path, move: Move, at: Array) -> Poses:
    """Read back at the samples' own times."""
    found: Poses = {}
    for body in body_transforms(move.boom, move.trajectory.q[0]):
        stream = RrdReader(path).stream().filter(content=f"/world/boom/{body}", is_static=False)
        batches = sorted((chunk.to_record_batch() for chunk in stream.to_chunks()), key=lambda b: b.column("t")[0].value)
        rows = {
            name: np.array([row[0] for batch in batches for row in batch.column(f"Transform3D:{name}").to_pylist()])[at]
            for name in ("translation", "quaternion")
        }
        T = np.tile(np.eye(4), (len(at), 1, 1))
        T[:, :3, 3], T[:, :3, :3] = rows["translation"], Rotation.from_quat(rows["quaternion"]).as_matrix()
        found[body] = T
    return found


def by_the_viewer(path: Path, move: Move, at: Array) -> Poses:
    """By the viewer's transform graph, with a picture at three of the times: all differ, and its
    log has no errors."""
    found: dict[str, list[Array]] = {}
    pictures = []
    program = shutil.which("rerun", path=sysconfig.get_path("scripts"))
    with ViewerClient.spawn(headless=True, port=_free_port(), executable_path=program) as viewer:
        viewer.open(str(path))
        for k, sample in enumerate(at):
            time = int(np.rint(move.trajectory.t[sample] * 1e9))
            viewer.set_time("t", duration=np.timedelta64(time, "ns"), play_state="paused")
            for child, T in _graph(viewer, time).items():
                found.setdefault(child, []).append(T)
            if k in PICTURES:
                pictures.append(_picture(viewer))
                (path.parent / f"{k}.png").write_bytes(pictures[-1])
        errors = [entry.message for entry in viewer.get_logs() if entry.level == "ERROR"]
        reports = [report.summary for view in viewer.get_state().views for report in view.reports]
    assert (errors, reports) == ([], [])
    images = [matplotlib.image.imread(io.BytesIO(png))[..., :3] for png in pictures]
    for one, other in ((0, 1), (1, 2), (0, 2)):
        changed = np.abs(images[one] - images[other]).max(axis=-1) > 0.1
        assert 1e-3 < changed.mean() < 0.5  # the boom has moved, and the panel stands
    return {child: np.array(T) for child, T in found.items()}


def _graph(viewer: ViewerClient, time: int) -> dict[str, Array]:
    """Pose of every frame in "mount", once the viewer has taken the data in and stands at that time
    [ns]."""
    for _ in range(50):
        graph = viewer.get_transform_graph(frame_filter="named", include_transforms=True)
        edges = {edge["child"]: edge["source"] for edge in graph["edges"] if edge["parent"] == "mount"}
        if int(graph["query"]["time"]) == time and len(edges) == 8 and not graph["missing_chunks"]:
            return {child: np.array(source["parent_from_child"]) for child, source in edges.items()}
        viewer.take_screenshot()  # which waits for the next one to be drawn
    raise AssertionError("the viewer has not come to that time")


def _picture(viewer: ViewerClient) -> bytes:
    """Once two are equal: the first ones still settle."""
    before = b""
    for _ in range(8):
        png = viewer.take_screenshot()
        if png == before:
            break
        before = png
    return png


def _free_port() -> int:
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        return int(listening.getsockname()[1])


READERS: list[Callable[[Path, Move, Array], Poses]] = [by_the_file, *([by_the_viewer] if VIEWER_RUNS else [])]


@pytest.mark.parametrize("read", READERS)
def test_link_poses_are_the_models(read: Callable[[Path, Move, Array], Poses], tmp_path: Path):
    move = plan(Boom.load(), "transport", "phenotyping", profile="time-optimal", step=0.02)
    write_recording(tmp_path / "move.rrd", move)
    at = np.linspace(0, len(move.trajectory.t) - 1, TIMES).round().astype(int)
    shown = read(tmp_path / "move.rrd", move, at)
    expected = body_transforms(move.boom, move.trajectory.q[at])
    assert set(shown) == set(expected)
    for body, T in expected.items():
        np.testing.assert_allclose(shown[body], T, rtol=0, atol=5e-7)
