"""Options that several commands share, and the objects that they name."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING
from functools import wraps
from typing import TYPE_CHECKING, Any

import click
import numpy as np
from click.core import ParameterSource

from boom_model import Boom, InputError
from boom_model.plausible import Range
from planner.cli.completion import OneOf, any_file, constraints, kinds_of_path, pitches, targets, vehicles
from planner.cli.printing import REPLACED
from planner.move_spec import MoveSpec, MoveWords
from planner.option_field import OptionField, options_of
from planner.paths.targets import TipTarget

if TYPE_CHECKING:
    from planner.files import Outputs
    from planner.motion.vehicle import VehicleCase

_ANGLES, _LIKE_RADIANS = 15.0, 0.3  # [deg] pitches that people ask for, and how near to one is meant
_CATALOGUE = "boom.catalogue"
_Command = Callable[..., Any]


def plausible(quantity: Range) -> Callable[[click.Context, click.Parameter, Any], Any]:
    """Return a callback that refuses a number outside the range of a quantity; None is accepted."""

    def within(_: click.Context, parameter: click.Parameter, value: Any) -> Any:
        if value is not None:
            quantity.require(parameter.opts[0].lstrip("-"), value)
        return value

    return within


_WORDS = options_of(MoveWords)
_COMPLETE = {
    "via": targets,
    "constraint": constraints,
    "vehicle": vehicles,
    "pitch": pitches,
    "along": kinds_of_path,
}


def word_option(name: str, *, default: Any = MISSING, help: str | None = None) -> Callable[[_Command], _Command]:
    """Return the option of a field of `MoveWords`.

    Args:
        name: the field.
        default: replaces the default of the field.
        help: replaces the help text of the field.
    """
    standard = getattr(MoveWords, name) if default is MISSING else default
    return described_option(name, _WORDS[name], standard, help=help, shell_complete=_COMPLETE.get(name))


def described_option(
    name: str, option: OptionField, default: Any, *, help: str | None = None, shell_complete: Any = None
) -> Callable[[_Command], _Command]:
    """Return the option of a field, made from its description.

    Args:
        name: the field.
        option: its description.
        default: of the field.
        help: replaces the help text.
        shell_complete: completes the option's value.
    """
    flag = option.flag or f"--{name.replace('_', '-')}"
    kinds: dict[str, Any] = {"default": default, "help": help or option.help, "shell_complete": shell_complete}
    if isinstance(default, bool) or option.flag is not None:
        kinds |= {"is_flag": True} | ({"flag_value": False} if option.negates else {})
    elif isinstance(default, tuple):
        kinds |= {"multiple": True, "metavar": option.form}
    elif option.choices:
        kinds |= {
            "default": str(default),
            "type": OneOf(option.choices),
            "show_default": True,
            "metavar": "|".join(option.choices),
        }
    elif option.quantity is not None:
        kinds |= {"type": float, "callback": plausible(option.quantity)}
        kinds |= {"metavar": option.form, "show_default": default is not None}
    else:
        kinds |= {"type": int if isinstance(default, int) else None}
        kinds |= {"metavar": option.form, "show_default": default is not None}
    return click.option(flag, name, **kinds)


def move_options(*left_out: str) -> Callable[[_Command], _Command]:
    """Return a decorator that adds START, GOAL and the options of a move to a command.

    The command receives them as `move: MoveWords`.

    Args:
        *left_out: fields of `MoveWords` that are not options of this command.
    """
    names = [name for name in _WORDS if name not in left_out]

    def decorate(command: _Command) -> _Command:
        @wraps(command)
        def run(start: str, goal: str, **given: Any) -> Any:
            words = {name: given.pop(name) for name in names}
            return command(move=MoveWords(start, goal, **words), **given)

        decorated: _Command = run
        for name in reversed(names):
            decorated = word_option(name)(decorated)
        goal = click.argument("goal", shell_complete=targets)
        return click.argument("start", shell_complete=targets)(goal(decorated))

    return decorate


_boom_option = click.option(
    "--boom", "boom_file", type=click.Path(), metavar="FILE.toml", help="File of a boom; default: the shipped one."
)
_catalogue_option = click.option(
    "--catalogue",
    type=click.Path(),
    metavar="FILE.toml",
    expose_value=False,
    callback=lambda context, _, value: context.meta.update({_CATALOGUE: value}),
    help="More motors, gearboxes and actuators, besides the shipped ones.",
)


def boom_option(command: _Command) -> _Command:
    """Add --boom and --catalogue to a command.

    `load_boom` reads --catalogue from the context, because a boom may name drives of that file.
    """
    return _boom_option(_catalogue_option(command))


def figure_option(
    name: str, quantity: Range, metavar: str, help: str, default: float | None = None
) -> Callable[[_Command], _Command]:
    """Return an option that takes a number within the range of a quantity.

    Args:
        name: with its dashes.
        quantity: what the number must be.
        metavar: its unit.
        help: what it is.
        default: None is none.
    """
    within, shown = plausible(quantity), default is not None
    return click.option(name, type=float, default=default, show_default=shown, callback=within, metavar=metavar, help=help)


payload_option = click.option("--payload", type=float, metavar="KG", help="Payload mass; default: that of the boom file.")
payload_as_option = click.option(
    "--payload-as", type=OneOf(["mass", "force"]), metavar="mass|force", default="mass", show_default=True,
    help="mass: the payload moves with the tip. force: only its weight acts there, as in the thesis.",
)  # fmt: skip
EPSG = Range(1024, 999_999, "")
epsg_option = click.option(
    "--epsg", type=int, callback=plausible(EPSG), metavar="CODE", help="Reference system of eastings and northings read."
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print one JSON object on standard output, in SI.")
all_option = click.option("--all", "whole", is_flag=True, help="Print every row, assumption and note.")
report_option = click.option(
    "--report",
    "document",
    type=click.Path(),
    metavar="FILE.md|.html|.pdf",
    help="Write the report, with pictures, versions and command.",
)
vehicle_option = word_option("vehicle")
pitch_option = word_option("pitch")
constraint_option = word_option("constraint")
picture_option = click.option(
    "--picture", shell_complete=any_file, metavar="FILE.png", help="Write a page with plots of the drives."
)


def given_catalogue() -> str | None:
    """Return the file of --catalogue."""
    name: str | None = click.get_current_context().meta.get(_CATALOGUE)
    return name


def load_boom(boom_file: str | None, payload: float | None = None) -> Boom:
    """Return the boom of --boom and --catalogue, with the payload of --payload."""
    boom = Boom.load(boom_file, given_catalogue())
    return boom if payload is None else boom.with_payload(payload)


def load_vehicle(vehicle: str | None) -> "VehicleCase":
    """Return the case of --vehicle; without it, a vehicle at rest on level ground."""
    from planner.motion.vehicle import LEVEL, load_case

    return LEVEL if vehicle is None else load_case(vehicle)


def doubts(spec: MoveSpec) -> tuple[str, ...]:
    """Return warnings: options that have no effect on this move, or a pitch in radians."""
    source, given = click.get_current_context().get_parameter_source, []
    if not any(isinstance(target, TipTarget) for target in spec.targets):
        given = [f"--{name} has no effect: no target is a tip=X,Y,Z" for name in ("constraint", "pitch")
                 if source(name) is ParameterSource.COMMANDLINE]  # fmt: skip
    if source("pass_via") is ParameterSource.COMMANDLINE and not spec.via:
        given.append("--pass-via has no effect: no --via is given")
    return (*given, *pitch_doubts(spec.pitch))


def pitch_doubts(pitch: float | None) -> tuple[str, ...]:
    """Return a warning if the degrees of a pitch [rad] are probably meant as radians."""
    if pitch is None:
        return ()
    degrees = float(np.degrees(pitch))
    meant = float(np.degrees(degrees))
    if not 0.1 < abs(degrees) < 6.3 or abs(meant / _ANGLES - round(meant / _ANGLES)) * _ANGLES > _LIKE_RADIANS:
        return ()
    return (f"pitch {degrees:g} is in degrees; {degrees:g} rad would be {meant:.0f}",)


def check_picture(picture: str | None) -> None:
    """Raise InputError if --picture is not a .png file."""
    if picture is not None and not picture.endswith(".png"):
        raise InputError(f"{picture}: the page of the drives is written as .png")


def outputs(*files: str | None, document: str | None = None, inputs: Iterable[str | None] = ()) -> "Outputs":
    """Return the output files of a command, the report last. Their names are checked here.

    Args:
        *files: names of files; None stands for no file.
        document: name of the report.
        inputs: files that the command reads.

    Raises:
        InputError: as `Outputs`; or the report has an unknown ending, or a file has the name of one
            of the report's pictures.
    """
    from planner.files import Outputs
    from planner.reports.document import is_picture_of, require_form

    read = [*inputs, given_catalogue()]
    if document is not None:
        require_form(document)
        for other in (*files, *read):
            if other is not None and is_picture_of(document, other):
                raise InputError(f"{other}: the report {document} would write a picture there")
    written = Outputs(*files, document, inputs=read)
    click.get_current_context().meta[REPLACED] = written.replaced
    return written


def with_names(files: Mapping[str, str | None]) -> dict[str, str]:
    """Return the files that have a name, by kind."""
    return {kind: name for kind, name in files.items() if name is not None}
