"""Files that the page saves: recording, motion, report, mission, and a command's files."""

import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import tomlkit

from boom_model import JOINTS, Basis, Boom, InputError, Origin, Sourced
from boom_model.boom import IS_LENGTH
from boom_model.boom_file import BOOM_FILE
from boom_model.toml_file import editable_toml
from planner.motion.trajectory import write_csv
from planner.page.drives import NONE
from planner.page.plans import BOOM_TOML, VEHICLE_TOML, Planned, command_line
from planner.page.state import LIMITS, State, written_limits
from planner.page.vehicle import LEVEL_SLOPE, slope_file


def files_of(state: State) -> dict[str, str]:
    """Return the name of each file that can be saved now, by kind."""
    names = {"recording": "move.rrd", "csv": "move.csv", "report": "move.html"} if state.planned is not None else {}
    names["mission"] = "mission-page.toml"
    if state.has_own_boom:
        names["boom"] = BOOM_TOML
    if state.move.vehicle is None and state.slope != LEVEL_SLOPE:
        names["vehicle"] = VEHICLE_TOML
    return names


def content(state: State, kind: str) -> bytes:
    """Return a file of `files_of`.

    Raises:
        InputError: the boom's file cannot be read.
    """
    texts: dict[str, Callable[[State], str]] = {
        "mission": mission_file,
        "boom": boom_file,
        "vehicle": lambda each: slope_file(each.slope),
    }
    if kind in texts:
        return texts[kind](state).encode()
    if state.planned is None:
        raise InputError("nothing is planned")
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / files_of(state)[kind]
        _WRITERS[kind](state, state.planned, place)
        return place.read_bytes()


def command(state: State) -> str:
    """Return the command that plans the page's move with the page's boom."""
    mass = state.boom.payload.mass
    return command_line(
        state.move,
        state.slope,
        payload=None if mass == state.original.payload.mass else mass,
        boom_file=state.boom_file,
        catalogue_file=state.catalogue_file,
        changed=state.has_own_boom,
    )


def mission_file(state: State) -> str:
    """Return the page's move as a mission of one step."""
    words, document = state.move, tomlkit.document()
    document["name"] = "page"
    document["basis"] = "assumed"
    document["source"] = "planned on the page"
    document["start"] = words.start
    step = tomlkit.table()
    step["to"] = words.goal
    for table in (document, step):  # of the start, and of the targets after it
        table["pitch"], table["constraint"] = words.pitch, words.constraint
    step["profile"] = words.profile
    given: Mapping[str, Any] = {
        "via": list(words.via),
        "along": words.along if words.along != "joint" else "",
        "pass_via": words.pass_via,
        "duration_s": words.duration,
        "jerk_bound": words.jerk_bound,
        "average_torque": words.average_torque,
    }
    for key, value in given.items():
        if value:
            step[key] = value
    steps = tomlkit.aot()
    steps.append(step)
    document["steps"] = steps
    return tomlkit.dumps(document)


def boom_file(state: State) -> str:
    """Return the boom's file with the page's drives and limits, and all else as it was.

    Raises:
        InputError: the file cannot be read any more.
    """
    document: Any = editable_toml(BOOM_FILE if state.boom_file is None else Path(state.boom_file))
    for joint, name in state.swapped.items():
        table, key = document["joints"][joint], "actuator" if IS_LENGTH[JOINTS.index(joint)] else "drive"
        if name == NONE:
            del table[key]
        elif key in table:
            table[key].update(_models(state.boom, joint))
        else:
            table[key] = _models(state.boom, joint) | _supply(state.boom, joint)
    for joint, name in state.raised:
        document["joints"][joint].update(_limit(state.boom, joint, name))
    return tomlkit.dumps(document)


def _limit(boom: Boom, joint: str, name: str) -> dict[str, Any]:
    """Return a limit with its key of the boom's file."""
    i, power = JOINTS.index(joint), ("", "2", "3")[LIMITS.index(name)]
    value = Sourced(written_limits(boom, name)[i], Origin(Basis.ASSUMED, "a fix of the page"))
    return {f"{name}_{'m' if IS_LENGTH[i] else 'deg'}_s{power}": _sourced(value)}


def _models(boom: Boom, joint: str) -> dict[str, Any]:
    drive = boom.drives[JOINTS.index(joint)]
    if drive is not None:
        return {"motor": drive.motor.name, "gearbox": drive.gearbox.name}
    return {} if boom.actuator is None else {"model": boom.actuator.actuator.name}


def _supply(boom: Boom, joint: str) -> dict[str, Any]:
    drive = boom.drives[JOINTS.index(joint)]
    brake = boom.actuator.brake if drive is None and boom.actuator is not None else None if drive is None else drive.brake
    given: dict[str, Sourced[Any] | None] = {"brake": brake}
    if drive is not None:
        given |= {"bus_voltage_V": drive.bus_voltage, "wiring": drive.wiring}
    return {key: _sourced(value) for key, value in given.items() if value is not None}


def _sourced(value: Sourced[Any]) -> Any:
    table = tomlkit.inline_table()
    plain = str(value.value) if isinstance(value.value, str) else value.value
    table.update({"value": plain, "basis": str(value.origin.basis), "source": value.origin.source})
    return table


def _recording(_: State, planned: Planned, place: Path) -> None:
    from planner.recording import write_recording

    write_recording(place, planned.move)


def _csv(_: State, planned: Planned, place: Path) -> None:
    write_csv(planned.move.trajectory, place, planned.move.loads.tau)


def _report(state: State, planned: Planned, place: Path) -> None:
    from planner.reports.document import write_document
    from planner.reports.drive_pictures import drive_pages
    from planner.reports.move_pictures import move_pictures

    move = planned.move
    shown = (move.boom, move.trajectory, move.loads.tau)
    pages = move_pictures(*shown) | drive_pages(*shown, move.full_report)
    write_document(place, move.full_report.to_markdown(), pages, command=f"{command(state)} --report {place.name}")


_WRITERS: dict[str, Callable[[State, Planned, Path], None]] = {"recording": _recording, "csv": _csv, "report": _report}
