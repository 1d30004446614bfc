"""Recordings read back and held against the move they were made of."""

import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun as rr
from rerun.chunk import RrdReader
from scipy.spatial.transform import Rotation

from boom_model.arrays import Array
from boom_model.boom import IS_LENGTH, JOINTS, MOVING_BODIES, Boom
from boom_model.drives.drive import available_torque, drive_inertia, drive_torque_limit, motor_torque
from boom_model.drives.gear_compliance import tip_deflection
from boom_model.errors import InputError
from boom_model.kinematics.forward import forward_kinematics
from boom_model.kinematics.frames import R_LINK_BODY, body_transforms, frame_transforms
from boom_model.provenance import Basis, Origin
from planner.motion.vehicle import base_pose, load_case
from planner.planning import Move, plan
from planner.recording import write_recording
from tests.builders import without_drives
from tests.recordings import recorded_entities, recorded_rows

BOOM = Boom.load()
FLOAT32 = 5e-7  # of positions up to 3 m and of rotations, once rounded to float32
UNITS = {"q": "", "qd": "/s", "qdd": "/s^2"}
NAMES = {"q": "position", "qd": "velocity", "qdd": "acceleration"}


def write(path: Path, move: Move) -> None:
    write_recording(path, move)


@dataclass(frozen=True)
class Recorded:
    """A recording on disk, and the move in it."""

    path: Path
    move: Move

    def rows(self, entity: str, component: str, static: bool = False) -> list[Any]:
        """A component's rows, in order of time."""
        return recorded_rows(self.path, entity, component, static)

    def static(self, entity: str, component: str) -> Any:
        (row,) = self.rows(entity, component, static=True)
        return row

    def times(self, entity: str) -> Array:
        """[ns]"""
        stream = RrdReader(self.path).stream().filter(content=entity, is_static=False)
        batches = [chunk.to_record_batch() for chunk in stream.to_chunks()]
        return np.sort(np.concatenate([batch.column("t").cast("int64").to_numpy() for batch in batches]))

    def scalars(self, entity: str) -> Array:
        return np.array(self.rows(entity, "Scalars:scalars"))

    def entities(self) -> set[str]:
        return recorded_entities(self.path)

    def poses(self, entity: str) -> Array:
        T = np.zeros((len(self.move.trajectory.t), 4, 4))
        T[:, 3, 3] = 1.0
        T[:, :3, 3] = np.array(self.rows(entity, "Transform3D:translation"))[:, 0]
        T[:, :3, :3] = Rotation.from_quat(np.array(self.rows(entity, "Transform3D:quaternion"))[:, 0]).as_matrix()
        return T

    def boxes(self, body: str) -> tuple[Array, Array]:
        """Low and high corners of a body's boxes in its link's axes, (boxes, 3) each."""
        R = R_LINK_BODY[body]
        centers = np.array(self.static(f"/world/boom/{body}", "Boxes3D:centers")) @ R.T
        halves = np.abs(np.array(self.static(f"/world/boom/{body}", "Boxes3D:half_sizes")) @ R.T)
        return centers - halves, centers + halves

    def in_world(self, body: str, e: float, p: float = 0.0) -> Array:
        """A point of a link, (e, p) in its axes, at every sample, by the recorded poses: (n, 3)."""
        T = self.poses(f"/world/boom/{body}")
        return T[:, :3, 3] + T[:, :3, :3] @ (np.array([e, p, 0.0]) @ R_LINK_BODY[body])


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    move = plan(BOOM, "transport", "phenotyping", step=0.03)
    path = tmp_path_factory.mktemp("recording") / "move.rrd"
    write(path, move)
    return Recorded(path, move)


@pytest.fixture(scope="module")
def standing(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    """The empty move, without a payload, of a boom whose position limits and coupled limit are
    assumed ones."""
    assumed = Origin(Basis.ASSUMED, "this test")
    origins = {**BOOM.limits.origins, "position": (assumed,) * 5, "linkage": (assumed,)}
    boom = replace(BOOM, limits=replace(BOOM.limits, origins=origins)).with_payload(0.0)
    path = tmp_path_factory.mktemp("recording") / "empty.rrd"
    move = plan(boom, "transport", "transport")
    write(path, move)
    return Recorded(path, move)


@pytest.mark.parametrize("which", ["recorded", "standing"])
def test_rerun_verifies_the_file(which: str, request: pytest.FixtureRequest):
    path = request.getfixturevalue(which).path
    done = subprocess.run([sys.executable, "-m", "rerun", "rrd", "verify", str(path)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "1 file verified without error" in done.stdout + done.stderr


def test_boom_rides_on_the_vehicle(tmp_path: Path, recorded: Recorded):
    case = load_case("ditch")
    ridden = Recorded(tmp_path / "ditch.rrd", plan(BOOM, "transport", "phenotyping", step=0.1, vehicle=case))
    write(ridden.path, ridden.move)
    np.testing.assert_allclose(ridden.poses("/world/mount"), base_pose(case, ridden.move.trajectory.t), rtol=0, atol=FLOAT32)
    for recording in (ridden, recorded):
        assert recording.rows("/world/mount", "Transform3D:parent_frame")[0] == ["tf#/world"]
        assert recording.rows("/world/mount", "Transform3D:child_frame")[0] == ["mount"]
    np.testing.assert_array_equal(recorded.rows("/world/mount", "Transform3D:translation"), [[[0.0, 0.0, 0.0]]])
    assert recorded.static("/world/tip_path", "CoordinateFrame:frame") == ["mount"]


# The plots


@pytest.mark.parametrize("i", [1, 2])
def test_motors_and_gearboxes_stand_beside_what_they_may(recorded: Recorded, i: int):
    drive, motion, tau = BOOM.drives[i], recorded.move.trajectory, recorded.move.loads.tau[:, i]
    assert drive is not None
    curve = available_torque(drive, 160 * motion.qd[:, i])
    torque = motor_torque(drive, tau, motion.qd[:, i], motion.qdd[:, i])
    expected = np.stack([np.abs(torque), curve, curve / 1.5], axis=-1)
    np.testing.assert_allclose(recorded.scalars(f"/plots/motor/{JOINTS[i]}"), expected, rtol=1e-12)
    assert recorded.static(f"/plots/motor/{JOINTS[i]}", "SeriesLines:names")[1] == "available (assumed) [Nm]"
    gearbox = recorded.scalars(f"/plots/gearbox/{JOINTS[i]}")
    np.testing.assert_array_equal(gearbox[:, 0], np.abs(tau))
    average = next(r.demand for r in recorded.move.report.rows if r.joint == JOINTS[i] and r.check == "gearbox average")
    assert gearbox[0, 1:].tolist() == [172.0, 275.0, 460.0, average]


def test_the_tips_budget_is_there(recorded: Recorded):
    budget = tip_deflection(BOOM, recorded.move.trajectory.q, recorded.move.loads.tau)
    np.testing.assert_allclose(recorded.scalars("/plots/tip/deflection")[:, -1], 1e3 * budget.total, rtol=1e-12)


def test_a_boom_without_motors_has_nothing_of_drives(tmp_path: Path):
    bare = without_drives(BOOM)
    recording = Recorded(tmp_path / "bare.rrd", plan(bare, "transport", "phenotyping", step=0.1))
    write(recording.path, recording.move)
    assert not [name for name in recording.entities() if "margins" in name or "motor" in name]


@pytest.mark.parametrize("i", range(5), ids=JOINTS)
def test_torque_parts_are_there_with_their_sum(recorded: Recorded, i: int):
    parts = recorded.move.parts
    names = ["gravity", "inertia", "velocity", "payload", "friction", "vehicle"]
    expected = np.stack([*(getattr(parts, name)[:, i] for name in names), parts.total[:, i]], axis=-1)
    entity = f"/plots/parts/{JOINTS[i]}"
    np.testing.assert_array_equal(recorded.scalars(entity), expected)
    assert recorded.static(entity, "SeriesLines:names") == [*names, "total"]
    np.testing.assert_allclose(expected[:, -1], recorded.move.loads.tau[:, i], rtol=0, atol=1e-12)


def test_mount_wrench_is_there(recorded: Recorded):
    for kind, columns in (("force", slice(0, 3)), ("moment", slice(3, 6))):
        vectors = recorded.move.loads.mount[:, columns]
        expected = np.column_stack([vectors, np.linalg.norm(vectors, axis=-1)])
        np.testing.assert_array_equal(recorded.scalars(f"/plots/mount/{kind}"), expected)


@pytest.mark.parametrize("which", ["recorded", "standing"])
def test_plots_are_the_move_exactly(which: str, request: pytest.FixtureRequest):
    recording: Recorded = request.getfixturevalue(which)
    trajectory = recording.move.trajectory
    for quantity in ("q", "qd", "qdd", "tau"):
        values = recording.move.loads.tau if quantity == "tau" else getattr(trajectory, quantity)
        for i, joint in enumerate(JOINTS):
            in_degrees = quantity != "tau" and not IS_LENGTH[i]
            expected = np.degrees(values[:, i]) if in_degrees else values[:, i]
            entity = f"/plots/{quantity}/{joint}"
            np.testing.assert_array_equal(recording.scalars(entity), expected[:, None])
            np.testing.assert_array_equal(recording.times(entity), np.rint(trajectory.t * 1e9).astype(np.int64))
    between = np.degrees(trajectory.q[:, 2] - trajectory.q[:, 1])
    np.testing.assert_array_equal(recording.scalars("/plots/q/linkage"), between[:, None])


@pytest.mark.parametrize("i", range(5), ids=JOINTS)
def test_limits_stand_beside_the_motion(recorded: Recorded, i: int):
    limits, ends = BOOM.limits, recorded.times(f"/plots/q/{JOINTS[i]}")[[0, -1]]
    for quantity, lower, upper in (
        ("q", limits.lower, limits.upper),
        ("qd", -limits.velocity, limits.velocity),
        ("qdd", -limits.acceleration, limits.acceleration),
    ):
        entity = f"/plots/{quantity}/{JOINTS[i]}/limits"
        expected = np.array([lower[i], upper[i]])
        np.testing.assert_array_equal(recorded.scalars(entity), [expected if IS_LENGTH[i] else np.degrees(expected)] * 2)
        np.testing.assert_array_equal(recorded.times(entity), ends)


def test_coupled_limit_stands_beside_the_linkage_angle(recorded: Recorded):
    np.testing.assert_allclose(recorded.scalars("/plots/q/linkage/limits"), [[5.0], [5.0]], rtol=1e-15)


def test_torque_between_its_limits_is_a_drive_within_its_own(recorded: Recorded):
    trajectory, tau = recorded.move.trajectory, recorded.move.loads.tau
    for i, drive in enumerate(BOOM.drives):
        entity = f"/plots/tau/{JOINTS[i]}/limits"
        if drive is None:
            assert entity not in recorded.entities()
            continue
        lower, upper = recorded.scalars(entity).T
        allowed = drive_torque_limit(drive, trajectory.qd[:, i])
        asked = tau[:, i] + drive_inertia(drive) * trajectory.qdd[:, i]
        np.testing.assert_allclose(upper - tau[:, i], allowed - asked, rtol=0, atol=1e-12)
        np.testing.assert_allclose(tau[:, i] - lower, allowed + asked, rtol=0, atol=1e-12)


def test_series_say_what_they_are_in_which_unit_and_what_is_assumed(recorded: Recorded):
    for quantity, name in NAMES.items():
        for i, joint in enumerate(JOINTS):
            unit = f"[{'m' if IS_LENGTH[i] else 'deg'}{UNITS[quantity]}]"
            mark = " (assumed)" if BOOM.limits.origins[name][i].basis is Basis.ASSUMED else ""
            assert recorded.static(f"/plots/{quantity}/{joint}", "SeriesLines:names") == [f"{joint} {name} {unit}"]
            limits = recorded.static(f"/plots/{quantity}/{joint}/limits", "SeriesLines:names")
            assert limits == [f"minimum {unit}{mark}", f"maximum {unit}{mark}"]
    assert recorded.static("/plots/q/linkage", "SeriesLines:names") == ["lower - inner [deg]"]
    assert recorded.static("/plots/q/linkage/limits", "SeriesLines:names") == ["minimum [deg]"]
    assert recorded.static("/plots/tau/extension", "SeriesLines:names") == ["extension force [N]"]
    assert recorded.static("/plots/tau/wrist", "SeriesLines:names") == ["wrist torque [Nm]"]
    assert recorded.static("/plots/tau/inner/limits", "SeriesLines:names") == [
        "drive minimum [Nm] (assumed)",  # by the assumed supply
        "drive maximum [Nm] (assumed)",
    ]


def test_assumed_position_limits_are_marked(standing: Recorded):
    expected = ["minimum [deg] (assumed)", "maximum [deg] (assumed)"]
    assert standing.static("/plots/q/yaw/limits", "SeriesPoints:names") == expected
    assert standing.static("/plots/q/linkage/limits", "SeriesPoints:names") == expected[:1]


# The linkage


@pytest.mark.parametrize("which", ["recorded", "standing"])
def test_frames_are_those_of_the_model(which: str, request: pytest.FixtureRequest):
    recording: Recorded = request.getfixturevalue(which)
    trajectory = recording.move.trajectory
    poses = body_transforms(BOOM, trajectory.q)
    assert set(poses) == {"base", *MOVING_BODIES, "tip"}
    for name, T in poses.items():
        entity = f"/world/boom/{name}"
        np.testing.assert_allclose(recording.poses(entity), T, rtol=0, atol=FLOAT32)
        np.testing.assert_array_equal(recording.times(entity), np.rint(trajectory.t * 1e9).astype(np.int64))
        assert recording.rows(entity, "Transform3D:child_frame") == [[name]] * len(T)
        assert recording.rows(entity, "Transform3D:parent_frame") == [["mount"]] * len(T)


def test_solids_hang_from_their_own_frames(recorded: Recorded):
    for body in ("base", *MOVING_BODIES, "tip"):
        assert recorded.static(f"/world/boom/{body}", "CoordinateFrame:frame") == [body]
    for body in ("lower", "upper", "end_effector"):
        assert recorded.static(f"/world/boom/{body}/pins", "CoordinateFrame:frame") == [body]


def test_solids_reach_from_pin_to_pin(recorded: Recorded):
    frames = frame_transforms(BOOM, recorded.move.trajectory.q, "outer")[..., :3, 3]
    shoulder, pin6, pin7, pin8, wrist, tip = np.moveaxis(frames[:, [3, 5, 6, 7, 9, 10]], 1, 0)
    for body, start, end in (
        ("lower", shoulder, pin6),
        ("inner", shoulder, pin8),
        ("outer", pin6, pin7),
        ("upper", pin8, pin7),
    ):
        low, high = recorded.boxes(body)
        assert low[0, 1] == -high[0, 1] < 0.0  # along the line between the pins
        np.testing.assert_allclose(recorded.in_world(body, low[0, 0]), start, rtol=0, atol=FLOAT32)
        np.testing.assert_allclose(recorded.in_world(body, high[0, 0]), end, rtol=0, atol=FLOAT32)
    low, high = recorded.boxes("extension")
    np.testing.assert_allclose(recorded.in_world("extension", low[0, 0]), wrist, rtol=0, atol=FLOAT32)
    low, high = recorded.boxes("end_effector")
    np.testing.assert_allclose(recorded.in_world("end_effector", 0.0, high[0, 1]), tip, rtol=0, atol=FLOAT32)


def test_pins_are_the_linkages(recorded: Recorded):
    frames = frame_transforms(BOOM, recorded.move.trajectory.q, "outer")
    yaw = recorded.move.trajectory.q[:, 0]
    normal = np.stack([np.sin(yaw), -np.cos(yaw), 0.0 * yaw], axis=-1)  # the arm plane's, which a cylinder's z must follow
    expected = {"lower": [3, 5], "upper": [7, 6], "end_effector": [9]}
    for body, indices in expected.items():
        centers = np.array(recorded.static(f"/world/boom/{body}/pins", "Cylinders3D:centers"))
        T = recorded.poses(f"/world/boom/{body}")
        shown = T[:, None, :3, 3] + np.einsum("nij,kj->nki", T[:, :3, :3], centers)
        np.testing.assert_allclose(shown, frames[:, indices][..., :3, 3], rtol=0, atol=FLOAT32)
        np.testing.assert_allclose(T[:, :3, 2], normal, rtol=0, atol=FLOAT32)


def test_the_rod_slides_in_its_housing(recorded: Recorded):
    (rod_low, rod_high), (low, high) = recorded.boxes("extension"), recorded.boxes("upper")
    housing_front, housing_rear = (recorded.in_world("upper", e[1, 0], (low[1, 1] + high[1, 1]) / 2.0) for e in (low, high))
    rod_front, rod_rear = (recorded.in_world("extension", e[0, 0]) for e in (rod_low, rod_high))
    axis = housing_rear - housing_front
    length = np.linalg.norm(axis, axis=-1, keepdims=True)
    for point in (rod_front, rod_rear):
        np.testing.assert_allclose(np.cross(point - housing_front, axis / length), 0.0, atol=2 * FLOAT32)
    along_rear = ((rod_rear - housing_front) * axis / length).sum(axis=-1)
    along_front = ((rod_front - housing_front) * axis / length).sum(axis=-1)
    assert (along_rear > 0.04).all()  # never pulled out, at full stroke neither
    assert (along_rear <= length[:, 0] + FLOAT32).all()
    assert (along_front < 0.0).all()  # and always to be seen


def test_tip_path_is_forward_kinematics(recorded: Recorded):
    strips = recorded.static("/world/tip_path", "LineStrips3D:strips")
    for before, after in pairwise(strips):
        assert before[-1] == after[0]
    points = np.concatenate([strips[0], *(strip[1:] for strip in strips[1:])])
    expected = forward_kinematics(BOOM, recorded.move.trajectory.q).position
    np.testing.assert_allclose(points, expected, rtol=0, atol=FLOAT32)


def test_payload_is_a_ball_of_steel_at_the_tip(recorded: Recorded, standing: Recorded):
    assert recorded.static("/world/boom/tip", "Points3D:positions") == [[0.0, 0.0, 0.0]]
    (radius,) = recorded.static("/world/boom/tip", "Points3D:radii")
    assert 4.0 / 3.0 * np.pi * radius**3 * 7850.0 == pytest.approx(10.0, rel=1e-6)
    assert standing.rows("/world/boom/tip", "Points3D:positions", static=True) == []


# Text and blueprint


def test_report_is_there_as_markdown(recorded: Recorded):
    assert recorded.static("/report", "TextDocument:text") == [recorded.move.full_report.to_markdown()]
    assert recorded.static("/report", "TextDocument:media_type") == ["text/markdown"]


def blueprint(recording: Recorded) -> dict[str, list[Any]]:
    """Every row of every component of the blueprint."""
    reader = RrdReader(recording.path)
    (store,) = reader.blueprints()
    found: dict[str, list[Any]] = {}
    for chunk in reader.stream(store=store).to_chunks():
        batch = chunk.to_record_batch()
        for name in batch.schema.names:
            if ":" in name:
                found.setdefault(name, []).extend(row for row in batch.column(name).to_pylist() if row is not None)
    return found


FIVE = {"Answer", "Torques", "Motion", "Drives", "Assumptions"}


@pytest.mark.parametrize("which", ["recorded", "standing"])
def test_blueprint_shows_everything(which: str, request: pytest.FixtureRequest):
    recording: Recorded = request.getfixturevalue(which)
    shown = blueprint(recording)
    origins = [row[0] for row in shown["ViewBlueprint:space_origin"]]
    plots = {e for e in recording.entities() if e.startswith("/plots/") and not e.endswith("/limits")}
    assert len(plots) == 4 * 5 + 1 + 1 + 5 + 5 + 2 + 1 + 3 * 2 + 1
    others = {
        "/world",
        "/legend",
        "/plane/inner",
        "/plane/lower",
        "/margins/inner",
        "/margins/lower",
        "/checks",
        "/assumptions",
        "/report",
    }
    others |= {"/answer", "/states", "/events"}
    strips = ["torques", "positions", "velocities", "accelerations", r"torque\ parts", "power", r"pins\ and\ mount"]
    others |= {f"/legends/{strip}" for strip in [*strips, "margins", "motors", "gearboxes", "tip"]}
    assert sorted(origins) == sorted(plots | others)
    classes = [row[0] for row in shown["ViewBlueprint:class_identifier"]]
    assert sorted(set(classes)) == ["2D", "3D", "StateTimeline", "TextDocument", "TextLog", "TimeSeries"]
    names = dict(zip(origins, (row[0] for row in shown["ViewBlueprint:display_name"]), strict=True))
    style = "SeriesLines" if which == "recorded" else "SeriesPoints"  # no line goes through one sample
    for plot in plots:
        curves = recording.static(plot, f"{style}:names")
        assert (
            names[plot].removesuffix(", no drive limits it") == curves[0]
            if len(curves) == 1 and "/power/" not in plot
            else re.search(r"\[(N|Nm|W|mm|%|-)\](, no (limit|drive) is given)?$", names[plot])
        )
    tabs = {row[0] for row in shown["ContainerBlueprint:display_name"]}
    joints, drives = (
        {"Positions", "Velocities", "Accelerations"},
        {"Torque-speed", "Margins", "Motors", "Gearboxes", "Tip", "All margins"},
    )
    assert tabs == FIVE | {"Torque parts", "Power", "Pins and mount"} | joints | drives
    assert shown["TimePanelBlueprint:timeline"] == [["t"]]


@pytest.mark.parametrize("which", ["recorded", "standing"])
def test_eye_sees_the_whole_move(which: str, request: pytest.FixtureRequest):
    recording: Recorded = request.getfixturevalue(which)
    eye, target = (np.array(blueprint(recording)[f"EyeControls3D:{name}"][0][0]) for name in ("position", "look_target"))
    frames = frame_transforms(BOOM, recording.move.trajectory.q, "outer")[..., :3, 3].reshape(-1, 3)
    view, toward = (target - eye) / np.linalg.norm(target - eye), frames - eye
    angles = np.degrees(np.arccos(toward @ view / np.linalg.norm(toward, axis=-1)))
    assert 15.0 < angles.max() < 27.0  # the viewer's field of view is some 55 degrees
    yaw = recording.move.trajectory.q[:, 0].mean()
    assert (eye - target) @ [np.sin(yaw), -np.cos(yaw), 0.0] > 1.0  # on the boom's right, across its plane
    assert eye[2] > target[2]


# The file


def others(path: Path) -> list[str]:
    return sorted(entry.name for entry in path.parent.iterdir() if entry != path)


@pytest.mark.parametrize("where", ["missing/move.rrd", "a file/move.rrd", "."])
def test_unwritable_path_is_bad_input(recorded: Recorded, tmp_path: Path, where: str):
    (tmp_path / "a file").write_text("something else")
    with pytest.raises(InputError, match="cannot be written"):
        write(tmp_path / where, recorded.move)
    assert [entry.name for entry in tmp_path.iterdir()] == ["a file"]


def test_old_recording_survives_a_failure_in_the_middle(recorded: Recorded, tmp_path: Path):
    path = tmp_path / "move.rrd"
    path.write_text("an old recording")
    move = recorded.move
    short = replace(move, trajectory=replace(move.trajectory, t=move.trajectory.t[:-1]))
    with pytest.raises(ValueError, match="broadcast"):
        write(path, short)
    assert path.read_text() == "an old recording"
    assert others(path) == []
    write(path, move)  # and nothing is left that hinders the next
    assert RrdReader(path).recordings()


@contextmanager
def files_no_longer_than(size: int) -> Iterator[None]:
    resource = pytest.importorskip("resource", reason="only POSIX limits the size of files")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_full_disk_is_an_error_and_loses_nothing(recorded: Recorded, tmp_path: Path):
    path = tmp_path / "move.rrd"
    path.write_text("an old recording")
    with files_no_longer_than(50_000), pytest.raises(InputError, match="File too large"):
        write(path, recorded.move)
    assert path.read_text() == "an old recording"
    assert others(path) == []


def test_recordings_stay_apart_and_leave_rerun_as_it_was(recorded: Recorded, tmp_path: Path):
    rr.set_strict_mode(False)  # as it is unless its user says otherwise
    path = tmp_path / "again.rrd"
    write(path, recorded.move)
    ids = {entry.recording_id for file in (path, recorded.path) for entry in RrdReader(file).recordings()}
    assert len(ids) == 2  # the viewer merges recordings that share an id
    assert others(path) == []
    assert rr.strict_mode() is False
    assert rr.get_global_data_recording() is None


def test_planner_does_not_import_rerun_by_itself():
    code = "import sys, planner; sys.exit('rerun' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
