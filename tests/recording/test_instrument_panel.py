"""The panel's own parts read back: colours of the path, arrows, planes, margins, texts, and several
moves in one recording."""

import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rerun.chunk import RrdReader

import planner
from boom_model import ActuatorHorizontal, Boom, InputError, body_transforms, forward_kinematics, inverse_kinematics, reach_map
from boom_model.arrays import Array
from boom_model.drives.drive import STEPPER_MARGIN, available_torque, motor_torque
from boom_model.drives.linear_actuator import LinearActuator, LinearDrive
from boom_model.keep_out import Box, KeepOut
from boom_model.kinematics.frames import frame_transforms
from boom_model.provenance import Basis, Origin
from planner import MoveSpec, cli
from planner.motion.vehicle import load_case
from planner.planning import Move, check_motion, plan
from planner.profile_table import profile_markdown, profile_moves, profile_rows
from planner.recording import write_moves_recording, write_recording
from planner.recording.drive_plots import margin
from planner.recording.palette import GREEN, GREY, LIGHT, ORANGE, VERMILION
from planner.recording.reach import boundary
from planner.recording.torque_ratio import torque_ratios, worst_ratio
from planner.reports.report import cells
from tests.builders import without_drives
from tests.recordings import recorded_entities, recorded_rows

BOOM = Boom.load()
FLOAT32 = 5e-7
SURROUNDINGS_NOTE = Origin(Basis.ASSUMED, "this test")


class Read:
    """A recording read back."""

    def __init__(self, path: Path):
        self.path = path

    def rows(self, entity: str, component: str, static: bool = False) -> list[Any]:
        return recorded_rows(self.path, entity, component, static)

    def static(self, entity: str, component: str) -> Any:
        (row,) = self.rows(entity, component, static=True)
        return row

    def scalars(self, entity: str) -> Array:
        return np.array(self.rows(entity, "Scalars:scalars"))

    def arrows(self, name: str) -> tuple[Array, Array]:
        """Feet and vectors (n, 3)."""
        rows = (self.rows(f"/world/loads/{name}", f"Arrows3D:{part}") for part in ("origins", "vectors"))
        feet, vectors = (np.array(part)[:, 0] for part in rows)
        return feet, vectors

    def entities(self) -> set[str]:
        return recorded_entities(self.path)

    def titles(self) -> dict[str, str]:
        """The views' titles by their origins."""
        reader = RrdReader(self.path)
        (store,) = reader.blueprints()
        titles = {}
        for chunk in reader.stream(store=store).to_chunks():
            batch = chunk.to_record_batch()
            if "ViewBlueprint:space_origin" in batch.schema.names:
                rows = (batch.column(f"ViewBlueprint:{part}").to_pylist() for part in ("space_origin", "display_name"))
                titles |= {origin[0]: name[0] for origin, name in zip(*rows, strict=True) if origin and name}
        return titles


def read(folder: Path, move: Move, **options: Any) -> Read:
    write_recording(folder / "move.rrd", move, **options)
    return Read(folder / "move.rrd")


@pytest.fixture(scope="module")
def move() -> Move:
    """Heavy, and as fast as the drives allow."""
    return plan(BOOM.with_payload(20.0), "transport", "phenotyping", profile="time-optimal", step=0.02)


@pytest.fixture(scope="module")
def panel(move: Move, tmp_path_factory: pytest.TempPathFactory) -> Read:
    return read(tmp_path_factory.mktemp("panel"), move)


def packed(color: tuple[int, ...]) -> int:
    red, green, blue = color
    return (red << 24) + (green << 16) + (blue << 8) + 255


# The path of the tip


BANDS = {"0072b2": 0.2, "56b4e9": 0.4, "009e73": 0.6, "f0e442": 0.8, "e69f00": 1.001, "d55e00": np.inf}
"""Okabe and Ito's colours, and the ratio up to which each stands."""


def ratio_by_datasheet(boom: Boom, move: Move) -> Array:
    """The worst drive's torque / limit from the figures of its sheet, sample by sample, written
    out: (n,)."""
    ratios, motion = [], move.trajectory
    for i, drive in enumerate(boom.drives):
        if drive is None:
            continue
        gear, tau, speed = drive.gearbox, move.loads.tau[:, i], motion.qd[:, i]
        own = gear.efficiency * gear.ratio**2 * (drive.motor.rotor_inertia + gear.input_inertia) * motion.qdd[:, i]
        curve = available_torque(drive, gear.ratio * speed) / (1.0 + STEPPER_MARGIN)
        bears = (curve - gear.no_load_input_torque) * gear.ratio * gear.efficiency
        ratios += [np.abs(tau) / gear.start_stop_torque, np.abs(tau + own) / bears]
    return np.max(ratios, axis=0)


@pytest.mark.parametrize(("planned_for", "carries", "over"), [(10.0, 10.0, False), (20.0, 20.0, False), (10.0, 20.0, True)])
def test_colour_of_the_path_is_the_worst_drives_ratio(planned_for: float, carries: float, over: bool, tmp_path: Path):
    light = plan(BOOM.with_payload(planned_for), "transport", "phenotyping", profile="time-optimal", step=0.02)
    heavy = check_motion(BOOM.with_payload(carries), light.trajectory)
    panel, ratio = read(tmp_path, heavy), ratio_by_datasheet(BOOM, heavy)
    strips = panel.static("/world/tip_path", "LineStrips3D:strips")
    colors = panel.static("/world/tip_path", "LineStrips3D:colors")
    assert len(strips) == len(colors) < len(ratio) / 4
    bounds = np.array(list(BANDS.values()))
    names = [f"{color >> 8:06x}" for color in colors]
    worse = np.maximum(ratio[1:], ratio[:-1])
    shown = np.concatenate([[list(BANDS).index(name)] * (len(strip) - 1) for name, strip in zip(names, strips, strict=True)])
    np.testing.assert_array_equal(shown, np.searchsorted(bounds, worse))
    assert len(set(names)) >= 2
    assert ("d55e00" in names) == (ratio.max() > 1.001) == over


def test_legend_names_every_band(panel: Read):
    for k, color in enumerate(BANDS):
        assert panel.static(f"/legend/{k}", "Points2D:colors") == [(int(color, 16) << 8) + 255]
    names = [panel.static(f"/legend/{k}/name", "Points2D:labels")[0] for k in range(len(BANDS))]
    assert names == ["below 0.2", "0.2 to 0.4", "0.4 to 0.6", "0.6 to 0.8", "0.8 to 1", "over the limit"]
    assert panel.titles()["/legend"] == "Path of the tip: largest torque / limit of all drives [-]"


def test_ratio_of_every_drive_is_plotted_beside_its_limit(panel: Read, move: Move):
    values = panel.scalars("/plots/ratio")
    assert panel.static("/plots/ratio", "SeriesLines:names") == ["inner", "lower", "limit"]
    np.testing.assert_allclose(values[:, :2].max(axis=1), ratio_by_datasheet(move.boom, move), rtol=1e-12)
    assert (values[:, 2] == 1.0).all()


def test_an_actuators_force_counts_against_its_peak_force(move: Move):
    sheet = LinearActuator("A", "this test", None, 50.0, *[None] * 8)
    ratios = torque_ratios(replace(BOOM, actuator=LinearDrive(sheet)), move.trajectory, move.loads.tau)
    assert list(ratios) == ["inner", "lower", "extension"]
    np.testing.assert_allclose(ratios["extension"], np.abs(move.loads.tau[:, 3]) / 50.0, rtol=1e-15)
    assert worst_ratio(ratios)[0] == ratios["extension"][0] > 1.0


def test_without_drives_the_path_says_so(tmp_path: Path):
    bare = plan(without_drives(BOOM), "transport", "phenotyping", step=0.1)
    panel = read(tmp_path, bare)
    assert panel.static("/world/tip_path", "LineStrips3D:colors") == [packed(LIGHT)]
    assert panel.static("/legend/0/name", "Points2D:labels") == ["no drive limit is known"]
    assert not [name for name in panel.entities() if name.startswith(("/plots/ratio", "/plots/margin", "/plane"))]


# Arrows


def test_arrows_are_the_loads_to_the_scale_that_is_stated(panel: Read, move: Move):
    force, moment = re.fullmatch(
        r"Boom \[m\]; arrows: white 1 m = (\d+) N, purple 1 m = (\d+) Nm", panel.titles()["/world"]
    ).groups()
    frames = frame_transforms(BOOM, move.trajectory.q, "outer")
    longest = 0.0
    for pin in (6, 7, 8):
        feet, vectors = panel.arrows(f"pin_{pin}")
        # Frame 4's axes by its own transform: x forward, y to the left, z up.
        expected = np.einsum("nij,nj->ni", frames[:, 1, :3, :3], getattr(move.loads.pins, f"frame_{pin}"))
        np.testing.assert_allclose(vectors * float(force), expected, rtol=0, atol=1e-6 * float(force))
        beside = feet - frames[:, pin - 1, :3, 3]
        np.testing.assert_allclose(beside, -0.1 * frames[:, 1, :3, 1], rtol=0, atol=FLOAT32)  # at the pin's end, on the right
        longest = max(longest, np.linalg.norm(vectors, axis=-1).max())
    for name, columns, scale in (("mount_force", slice(0, 3), force), ("mount_moment", slice(3, 6), moment)):
        feet, vectors = panel.arrows(name)
        np.testing.assert_allclose(vectors * float(scale), move.loads.mount[:, columns], rtol=0, atol=1e-6 * float(scale))
        assert not feet.any()
        assert panel.static(f"/world/loads/{name}", "CoordinateFrame:frame") == ["mount"]
        longest = max(longest, np.linalg.norm(vectors, axis=-1).max())
    assert 0.3 < longest <= 0.9
    sizes = np.stack([np.linalg.norm(panel.arrows(f"pin_{pin}")[1], axis=-1) for pin in (6, 7, 8)], axis=-1)
    np.testing.assert_allclose(panel.scalars("/plots/pins"), sizes * float(force), rtol=1e-6)


# Ground, vehicle, reach


def test_ground_and_vehicle_are_marked_as_for_display_only(panel: Read, move: Move):
    for name in ("ground", "vehicle", "plot"):
        shown = "breeder plot" if name == "plot" else name
        assert set(panel.static(f"/world/{name}", "Boxes3D:labels")) == {f"{shown}, for display only"}
    ((_, _, ground),) = panel.static("/world/ground", "Boxes3D:centers")
    assert ground < forward_kinematics(BOOM, move.trajectory.q).position[:, 2].min() - 0.2
    assert "for display only, because the boom file does not define" in panel.static("/assumptions", "TextDocument:text")[0]


def test_shapes_of_the_booms_file_take_their_place(tmp_path: Path):
    shape = Box("cab", np.array([-2.0, 0.0, -1.0]), np.ones(3), SURROUNDINGS_NOTE)
    given = replace(BOOM, keep_out=KeepOut((shape,), 0.05, 0.05, 0.1, SURROUNDINGS_NOTE))
    panel = read(tmp_path, plan(given, "transport", "phenotyping", step=0.1))
    assert {"/world/ground", "/world/vehicle"}.isdisjoint(panel.entities())
    assert "/world/keep_out/cab" in panel.entities()
    assert "drawn for display only" not in panel.static("/assumptions", "TextDocument:text")[0]


def test_reach_is_drawn_where_it_is_asked_for(tmp_path: Path, panel: Read, move: Move):
    hold, pitch = ActuatorHorizontal(), -np.pi / 2.0
    found = reach_map(BOOM, hold, pitch)
    with_reach = read(tmp_path, move, reach=found)
    strips = with_reach.static("/world/reach", "LineStrips3D:strips")
    assert with_reach.static("/world/reach", "CoordinateFrame:frame") == ["base"]  # and so it yaws with the boom
    assert with_reach.titles()["/world"].endswith(f"; grey line: reach with constraint {hold}, pitch -90 deg")
    assert "/world/reach" not in panel.entities()
    points = np.concatenate([np.array(strip) for strip in strips])
    np.testing.assert_allclose(points, np.concatenate([np.insert(line, 1, 0.0, axis=1) for line in boundary(found)]), atol=1e-6)
    # One cell inwards is within the limits, one outwards is not: each point has both among its
    # neighbours.
    cell = found.r[1] - found.r[0]
    around = points[::17, None] + cell * np.array([(x, 0.0, z) for x in (-1, 0, 1) for z in (-1, 0, 1)])
    reached = [[inverse_kinematics(BOOM, point, pitch, hold).solutions for point in ring] for ring in around]
    within = np.array([[any(s.within_limits for s in solutions) for solutions in ring] for ring in reached])
    assert (within.any(axis=1) & ~within.all(axis=1)).all()


# Drives


@pytest.mark.parametrize("i", [1, 2])
def test_operating_point_moves_in_the_torque_speed_plane(panel: Read, move: Move, i: int):
    joint, drive = ("inner", "lower")[i - 1], BOOM.drives[i]
    entity = f"/plane/{joint}"
    now = np.array(panel.rows(f"{entity}/now", "Points2D:positions"))[:, 0]
    assert len(now) == len(move.trajectory.t)

    def tick(unit: str, axis: int) -> float:
        """Units of the plane for one of `unit`, by the grid and what it says."""
        name = f"{entity}/grid/{unit}/1"
        value = float(panel.static(f"{name}/value", "Points2D:labels")[0].removesuffix(f" {unit}"))
        at = panel.static(name, "LineStrips2D:strips")[0][0][axis]
        return (at if axis == 0 else 1.0 - at) / value

    speed, torque = now[:, 0] / tick("rpm", 0), (1.0 - now[:, 1]) / tick("Nm", 1)
    expected = 160.0 * np.abs(move.trajectory.qd[:, i]) * 30.0 / np.pi
    np.testing.assert_allclose(speed, expected, rtol=0, atol=1e-6 * 2000.0)
    np.testing.assert_allclose(torque, panel.scalars(f"/plots/motor/{joint}")[:, 0], rtol=0, atol=1e-5)
    for name, share in (("available", 1.0), ("with_margin", 1.5)):
        curve = np.array(panel.static(f"{entity}/{name}", "LineStrips2D:strips")[0])
        given = available_torque(drive, curve[:, 0] / tick("rpm", 0) * np.pi / 30.0) / share
        np.testing.assert_allclose((1.0 - curve[:, 1]) / tick("Nm", 1), given, rtol=0, atol=1e-4)
    back = np.array(panel.static(f"{entity}/reversed", "LineStrips2D:strips")[0])
    np.testing.assert_allclose(back[:, 0], now[:, 0], rtol=0, atol=1e-6)
    reversed_torque = motor_torque(drive, move.loads.tau[:, i], -move.trajectory.qd[:, i], move.trajectory.qdd[:, i])
    np.testing.assert_allclose((1.0 - back[:, 1]) / tick("Nm", 1), np.abs(reversed_torque), rtol=0, atol=1e-5)
    title = panel.titles()[entity]
    assert title == f"{joint}, MST342C02: absolute motor torque [Nm] over speed [rpm]; 80 V, parallel"
    assert panel.static(f"{entity}/available/name", "Points2D:labels") == ["available (assumed)"]


@pytest.mark.parametrize("joint", ["inner", "lower"])
def test_least_margin_over_time_is_the_reports(panel: Read, move: Move, joint: str):
    values, names = panel.scalars(f"/plots/margin/{joint}"), panel.static(f"/plots/margin/{joint}", "SeriesLines:names")
    rows = {row.check: row for row in move.report.rows if row.joint == joint}
    # The report looks ten times as closely.
    for name, check in (("gearbox, start-stop [%]", "gearbox repeated peak"), ("motor (assumed) [%]", "motor torque")):
        assert values[:, names.index(name)].min() == pytest.approx(100.0 * rows[check].margin, rel=0.02)
    peak = values[:, names.index("gearbox, momentary peak [%]")]
    torque = panel.scalars(f"/plots/gearbox/{joint}")[:, 0]
    np.testing.assert_allclose(peak, 100.0 * np.minimum(BOOM.drives[1].gearbox.peak_torque / torque - 1.0, 3.0), rtol=1e-9)
    assert values[0, names.index("gearbox, required [%]")] == 0.0
    assert values[0, names.index("motor, required [%]")] == 50.0


@pytest.mark.parametrize("joint", ["inner", "lower"])
def test_a_bar_for_every_margin_of_the_report(panel: Read, move: Move, joint: str):
    rows = [row for row in move.report.rows if row.joint == joint and row.check.startswith(("gearbox", "motor"))]
    rows = [row for row in rows if row.margin is not None or row.verdict == "NOT CHECKABLE"]
    entity, colors = f"/margins/{joint}", {"PASS": GREEN, "WARN": ORANGE, "FAIL": VERMILION, "INFO": GREY}
    heights = np.array(panel.static(f"{entity}/check", "Points2D:positions"))[:, 1]
    assert panel.static(f"{entity}/check", "Points2D:labels") == [row.check for row in rows]
    shown = [cells(row)[4] if row.margin is not None else "NOT CHECKABLE" for row in rows]
    assert panel.static(f"{entity}/margin", "Points2D:labels") == shown
    known = [row for row in rows if row.margin is not None]
    assert panel.static(f"{entity}/bars", "LineStrips2D:colors") == [packed(colors[row.verdict]) for row in known]
    bars = np.array(panel.static(f"{entity}/bars", "LineStrips2D:strips"))
    caps = np.copysign(panel.static(f"{entity}/bars", "LineStrips2D:radii"), bars[:, 1, 0])  # a line has round caps
    ends = bars[:, 1, 0] + caps
    np.testing.assert_allclose(bars[:, 0, 0], caps, rtol=0, atol=1e-6)
    np.testing.assert_allclose(ends, np.clip([row.margin for row in known], -1.0, 3.0), rtol=0, atol=1e-6)
    below = bars[:, 0, 1] - heights[[row.margin is not None for row in rows]]
    np.testing.assert_allclose(below, below[0], rtol=0, atol=1e-6)
    required = np.array(panel.static(f"{entity}/required", "LineStrips2D:strips"))
    assert required[:, 0, 0].tolist() == [row.required_margin for row in known if row.required_margin]


def test_margin_of_nothing_asked_is_cut_off():
    np.testing.assert_allclose(margin(np.array([0.0, 0.1, 0.5, 2.0]), np.ones(4)), [3.0, 3.0, 1.0, -0.5])


# Texts


def test_checks_are_a_table_of_the_reports_rows(panel: Read, move: Move):
    text = panel.static("/checks", "TextDocument:text")[0]
    assert panel.static("/checks", "TextDocument:media_type") == ["text/markdown"]
    header, _, *rows = [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("|")]
    assert header == ["verdict", "joint", "check", "demand", "limit", "margin", "required", "at", "basis"]
    assert len(rows) == len(move.report.rows)
    for shown, row in zip(rows, move.report.rows, strict=True):
        *told, verdict, basis = cells(row)
        assert [*shown[1:8], shown[0].strip("*"), shown[8]] == [*told, verdict, basis]
        assert shown[0].startswith("**") == (row.verdict == "FAIL")
    assert move.report.summary in text


def test_assumptions_are_a_page(panel: Read, move: Move):
    text = panel.static("/assumptions", "TextDocument:text")[0]
    assert move.report.assumptions
    for sentence in move.report.assumptions + move.report.notes:
        assert f"- {sentence}\n" in text
    assert "## Drawn" in text


def test_every_view_says_its_unit(panel: Read):
    texts = {"/answer", "/states", "/events", "/checks", "/assumptions", "/report"}
    for origin, title in panel.titles().items():
        assert (
            origin in texts
            or origin.startswith("/legends/")
            or re.search(r"\[(m|m/s|m/s\^2|deg|deg/s|deg/s\^2|N|Nm|W|mm|%|-)\]", title)
        ), (origin, title)


# Several moves


@pytest.fixture(scope="module")
def moves() -> dict[str, Move]:
    return profile_moves(BOOM, MoveSpec.of("transport", "phenotyping", step=0.05))[0]


@pytest.fixture(scope="module")
def several(moves: dict[str, Move], tmp_path_factory: pytest.TempPathFactory) -> Read:
    path = tmp_path_factory.mktemp("several") / "profiles.rrd"
    write_moves_recording(path, moves, profile_markdown(profile_rows(moves)))
    return Read(path)


def entity_of(name: str) -> str:
    return re.sub(r"([^\w.-])", r"\\\1", name)


def test_every_move_has_its_boom_and_its_curves(several: Read, moves: dict[str, Move]):
    colors = set()
    for name, move in moves.items():
        place = f"/world/moves/{entity_of(name)}"
        for body, T in body_transforms(BOOM, move.trajectory.q).items():
            shown = np.array(several.rows(f"{place}/{body}", "Transform3D:translation"))[:, 0]
            np.testing.assert_allclose(shown, T[:, :3, 3], rtol=0, atol=FLOAT32)
            assert several.rows(f"{place}/{body}", "Transform3D:child_frame")[0] == [f"{name} {body}"]
        for quantity, values in (("qd", np.degrees(move.trajectory.qd)), ("tau", move.loads.tau)):
            curve = several.scalars(f"/plots/{quantity}/inner/{entity_of(name)}")
            np.testing.assert_array_equal(curve[:, 0], values[:, 1])
        worst = several.scalars(f"/plots/ratio/{entity_of(name)}")[:, 0]
        np.testing.assert_allclose(worst, ratio_by_datasheet(BOOM, move), rtol=1e-12)
        (color,) = several.static(f"{place}/inner", "LineStrips3D:colors")
        assert several.static(f"/plots/q/yaw/{entity_of(name)}", "SeriesLines:colors") == [color]
        assert several.static(f"/plots/q/yaw/{entity_of(name)}", "SeriesLines:names") == [f"{name} [deg]"]
        colors.add(color)
    assert len(colors) == len(moves)
    longest = max(move.trajectory.duration for move in moves.values())
    assert longest == moves["quintic"].trajectory.duration
    np.testing.assert_allclose(several.scalars("/plots/qd/inner/limits"), [[-45.0, 45.0]] * 2, rtol=1e-12)
    assert several.static("/reading", "TextDocument:text")[0].count("\n") == len(moves) + 2


def test_lines_of_a_boom_lead_from_pin_to_pin(several: Read, moves: dict[str, Move]):
    q = moves["cubic"].trajectory.q
    frames = frame_transforms(BOOM, q, "outer")[..., :3, 3]
    shoulder, pin6, pin7, pin8, wrist, tip = np.moveaxis(frames[:, [3, 5, 6, 7, 9, 10]], 1, 0)
    poses = body_transforms(BOOM, q)
    for body, start, end in (
        ("lower", shoulder, pin6),
        ("inner", shoulder, pin8),
        ("outer", pin6, pin7),
        ("upper", pin8, pin7),
    ):
        line = np.array(several.static(f"/world/moves/cubic/{body}", "LineStrips3D:strips")[0])
        T = poses[body]
        shown = T[:, None, :3, 3] + np.einsum("nij,kj->nki", T[:, :3, :3], line)
        np.testing.assert_allclose(shown[:, 0], start, rtol=0, atol=2 * FLOAT32)
        np.testing.assert_allclose(shown[:, 1], end, rtol=0, atol=2 * FLOAT32)
    for body, index, expected in (("extension", 0, wrist), ("end_effector", 1, tip), ("base", 0, np.zeros(3))):
        (line,) = several.static(f"/world/moves/cubic/{body}", "LineStrips3D:strips")
        T = poses[body]
        np.testing.assert_allclose(T[:, :3, 3] + T[:, :3, :3] @ line[index], expected + 0.0 * tip, rtol=0, atol=2 * FLOAT32)


def test_moves_that_cannot_share_a_scene_are_refused(tmp_path: Path):
    ridden = plan(BOOM, "transport", "phenotyping", step=0.1, vehicle=load_case("slope"))
    for given, message in (({}, "moves is empty"), ({"slope": ridden}, "cannot share one recording")):
        with pytest.raises(InputError, match=message):
            write_moves_recording(tmp_path / "none.rrd", given, "")
    assert not list(tmp_path.iterdir())


def boom(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    """The command's exit code."""
    monkeypatch.setattr(sys, "argv", ["boom", *arguments])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    return int(stop.value.code or 0)


def test_profiles_are_recorded_by_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any):
    monkeypatch.chdir(tmp_path)
    assert boom(monkeypatch, "profiles", "transport", "transport", "--out", "none.rrd") == 0  # empty moves
    assert capsys.readouterr().out.splitlines()[-2] == "recording: none.rrd"
    assert boom(monkeypatch, "profiles", "transport", "phenotyping", "--json", "--out", "all.rrd") == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["files"] == {"recording": "all.rrd"}
    entities = Read(tmp_path / "all.rrd").entities()
    assert {f"/world/moves/{entity_of(row['profile'])}/upper" for row in answer["profiles"]} <= entities
    assert boom(monkeypatch, "profiles", "transport", "phenotyping", "--out", "none/all.rrd") == 2


def test_reach_is_recorded_by_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any):
    monkeypatch.chdir(tmp_path)
    at_rest = ("plan", "transport", "transport", "--show-reach")
    assert boom(monkeypatch, *at_rest, "--constraint", "extension=0.25") == 0
    assert "; grey line: reach with constraint extension=0.25 m, pitch -90" in Read(tmp_path / "move.rrd").titles()["/world"]
    assert boom(monkeypatch, *at_rest, "--constraint", "extension=5", "--out", "nothing.rrd") == 0
    nothing = Read(tmp_path / "nothing.rrd")
    assert "/world/reach" not in nothing.entities()
    assert nothing.titles()["/world"].endswith("; no point reachable with constraint extension=5 m, pitch -90 deg")
    capsys.readouterr()
    assert boom(monkeypatch, *at_rest, "--pitch", "free") == 2
    assert capsys.readouterr().err == "boom: pitch free: the workspace is drawn for one pitch\n"


def test_one_package_knows_rerun():
    root = Path(planner.__file__).parent.parent
    code = [file for package in ("boom_model", "planner") for file in (root / package).rglob("*.py")]
    importing = [file for file in code if re.search(r"^\s*(import|from) rerun", file.read_text(encoding="utf-8"), re.MULTILINE)]
    assert importing
    assert {file.parent for file in importing} == {root / "planner" / "recording"}


def test_rerun_verifies_the_moves(several: Read):
    done = subprocess.run([sys.executable, "-m", "rerun", "rrd", "verify", str(several.path)], capture_output=True, text=True)
    assert "1 file verified without error" in done.stdout + done.stderr
