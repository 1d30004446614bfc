"""The commands for inverse kinematics and the workspace."""

from typing import TYPE_CHECKING, Any

import click
import numpy as np

from boom_model import (
    JOINTS,
    Boom,
    InfeasibleError,
    InputError,
    forward_kinematics,
    gravity_torque,
    inverse_kinematics,
    tip_covariance,
    transmission_angle,
)
from boom_model.boom import IS_LENGTH, LOAD_UNITS, in_degrees
from boom_model.kinematics.constraints import parse_constraint
from planner.cli.completion import Coordinate, any_file, targets
from planner.cli.options import (
    boom_option,
    constraint_option,
    json_option,
    load_boom,
    outputs,
    payload_option,
    pitch_doubts,
    pitch_option,
)
from planner.cli.printing import print_files, print_json, print_lines, print_rows
from planner.paths.targets import TipTarget, parse_pitch, parse_target, unreachable

if TYPE_CHECKING:
    from boom_model.kinematics.reach import ReachMap
    from planner.files import Outputs


@click.command(context_settings={"ignore_unknown_options": True})
@click.argument("x", type=Coordinate())
@click.argument("y", type=Coordinate())
@click.argument("z", type=Coordinate())
@pitch_option
@constraint_option
@payload_option
@boom_option
@json_option
def ik(
    x: float, y: float, z: float, pitch: str, constraint: str, payload: float | None, boom_file: str | None, as_json: bool
) -> int:
    """List every joint position with the tip at X Y Z (m, in the base frame).

    \b
    Example:
      boom ik 1.4 0 1.0 --pitch down --constraint extension=0.25
    """
    boom = load_boom(boom_file, payload)
    angle, chosen, position = parse_pitch(pitch), parse_constraint(constraint), (x, y, z)
    found = inverse_kinematics(boom, position, angle, chosen)
    reason = None if found.best is not None else unreachable(boom, position, angle, chosen)
    if as_json:
        answer: dict[str, Any] = {
            "target": {"position_m": position, "pitch_rad": found.pitch, "hold": str(chosen)},
            "solutions": [
                {"q": s.q.tolist(), "within_limits": s.within_limits, "reasons": list(s.reasons)} for s in found.solutions
            ],
            "best": found.best,
        }
        print_json(answer if reason is None else answer | {"reason": reason})
    elif found.solutions:
        rows, broken = [], []
        for i, s in enumerate(found.solutions):
            q = in_degrees(s.q)
            best = " (best)" if i == found.best else ""
            rows.append((f"{i + 1}{best}", *(f"{v:.4f}" for v in q), "yes" if s.within_limits else "no"))
            broken += [f"branch {i + 1}: {text}" for text in s.reasons]
        print_rows(("branch", "yaw deg", "inner deg", "lower deg", "extension m", "wrist deg", "in limits"), rows)
        print_lines(None, broken)
    if not as_json:
        print_lines("note", pitch_doubts(angle))
    if reason is not None:
        raise InfeasibleError(reason)
    return 0


@click.command(context_settings={"ignore_unknown_options": True})
@click.argument("joints", metavar="POSE|q=YAW,INNER,LOWER,EXTENSION,WRIST", shell_complete=targets)
@boom_option
@json_option
def fk(joints: str, boom_file: str | None, as_json: bool) -> int:
    """Show the tip at a joint position, in the base frame, and the joint torques that hold it.

    \b
    Examples:
      boom fk phenotyping
      boom fk q=0,90,180,0.5,0
    """
    boom, target = load_boom(boom_file), parse_target(joints)
    if isinstance(target, TipTarget):
        raise InputError(f"{joints}: a tip target has no joint position yet; boom ik X Y Z finds those that reach it")
    q = boom.pose(target) if isinstance(target, str) else np.asarray(target)
    tip, tau = forward_kinematics(boom, q), np.round(gravity_torque(boom, q), 9) + 0.0
    reasons, covariance = boom.limits.reasons(q), tip_covariance(boom, q)
    spread = None if covariance is None or np.isnan(covariance).any() else np.sqrt(np.diag(covariance))
    if as_json:
        print_json(
            {
                "q": q.tolist(),
                "position_m": tip.position.tolist(),
                "position_sd_m": None if spread is None else spread.tolist(),
                "pitch_rad": float(tip.pitch),
                "transmission_angle_rad": float(transmission_angle(boom, q)),
                "gravity_torque": tau.tolist(),
                "within_limits": not reasons,
                "reasons": reasons,
            }
        )
        return 0
    x, y, z = tip.position
    click.echo(f"tip at x {x:.4f} m, y {y:.4f} m, z {z:.4f} m, pitch {np.degrees(tip.pitch):.2f} deg")
    if spread is not None:
        dx, dy, dz = spread * 1e3
        click.echo(f"standard deviation, as calibrated: x {dx:.2f} mm, y {dy:.2f} mm, z {dz:.2f} mm")
    shown = zip(JOINTS, in_degrees(q), tau, LOAD_UNITS, IS_LENGTH, strict=True)
    rows = [(name, f"{at:.4f} {'m' if length else 'deg'}", f"{load:.2f} {unit}") for name, at, load, unit, length in shown]
    print_rows(("joint", "position", f"to hold {boom.payload.mass:g} kg"), rows)
    shape = "parallelogram" if boom.geometry.is_parallelogram else "linkage"
    click.echo(f"transmission angle {np.degrees(transmission_angle(boom, q)):.1f} deg; 0 deg is a flat {shape}")
    print_lines("outside the limits", reasons)
    return 0


@click.command()
@pitch_option
@constraint_option
@payload_option
@click.option(
    "--out",
    shell_complete=any_file,
    default="reach.png",
    show_default=True,
    metavar="FILE.png|FILE.rrd",
    help="Picture or recording to write.",
)
@boom_option
@json_option
def reach(pitch: str, constraint: str, payload: float | None, out: str, boom_file: str | None, as_json: bool) -> int:
    """Draw the workspace in the arm's vertical plane, coloured by torque margin.

    \b
    Example:
      boom reach --constraint least-torque --payload 8 --out reach.png
    """
    from boom_model.kinematics.reach import reach_map

    if not out.endswith((".png", ".rrd")):
        raise InputError(f"{out}: a reach map is written as .png or .rrd")
    boom, angle, chosen = load_boom(boom_file, payload), parse_pitch(pitch), parse_constraint(constraint)
    if angle is None:
        raise InputError("pitch free: a reach map is drawn for one pitch")
    files = outputs(out, inputs=(boom_file,))
    found = reach_map(boom, chosen, angle)
    answer: dict[str, Any] = {"hold": str(chosen), "pitch_rad": angle, "payload_kg": boom.payload.mass} | _counts(found)
    if not answer["within_limits"]:
        reason = f"no tip position with pitch {np.degrees(angle):.4g} deg and constraint {chosen} is within the limits"
        if as_json:
            print_json(answer | {"reason": reason})
        raise InfeasibleError(reason)
    answer |= {"files": _write_reach(files, out, boom, found)} | _extents(found)
    if as_json:
        print_json(answer)
    else:
        _print_reach(answer)
    return 0


def _counts(found: "ReachMap") -> dict[str, Any]:
    """Return the numbers of cells of a reach map."""
    return {
        "cells": found.exists.size,
        "exists": int(found.exists.sum()),
        "within_limits": int(found.within_limits.sum()),
        "overloaded": int((found.torque_margin < 0.0).sum()),
        "files": {},
    }


def _extents(found: "ReachMap") -> dict[str, Any]:
    """Return the largest and smallest values over the cells within the limits."""
    row, column = np.nonzero(found.within_limits)
    margin = found.torque_margin[row, column]
    known = bool(np.isfinite(margin).all())
    return {
        "largest_r_m": float(np.abs(found.r[column]).max()),
        "lowest_z_m": float(found.z[row].min()),
        "highest_z_m": float(found.z[row].max()),
        "least_torque_margin": float(margin.min()) if known else None,
        "largest_torque_margin": float(margin.max()) if known else None,
    }


def _write_reach(files: "Outputs", out: str, boom: Boom, found: "ReachMap") -> dict[str, str]:
    """Write the picture or the recording of a reach map; return its name by kind."""
    with files:
        if out.endswith(".png"):
            from planner.reports.reach_picture import reach_title, write_reach_picture

            write_reach_picture(files.temporary(out), boom, found, reach_title(boom, found))
            return {"picture": out}
        from planner.recording import write_reach_recording

        write_reach_recording(files.temporary(out), boom, found)
        return {"recording": out}


def _print_reach(answer: dict[str, Any]) -> None:
    print_lines(
        None,
        [
            f"{answer['within_limits']} of {answer['cells']} cells are reachable within the limits: r up to "
            f"{answer['largest_r_m']:.2f} m, z from {answer['lowest_z_m']:.2f} to {answer['highest_z_m']:.2f} m"
        ],
    )
    least, largest = answer["least_torque_margin"], answer["largest_torque_margin"]
    if least is not None:
        click.echo(f"torque margin {least:.3f} to {largest:.3f}; {answer['overloaded']} cells overload a drive")
    print_files(answer["files"])
