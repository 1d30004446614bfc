"""Options that several commands share, and what they stand for."""

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import click

from boom_model import Boom, InputError
from boom_model.kinematics.constraints import CONSTRAINTS
from boom_model.plausible import Range

if TYPE_CHECKING:
    from planner.files import Outputs
    from planner.motion.vehicle import VehicleCase

_CATALOGUE = "boom.catalogue"

_boom_option = click.option("--boom", "boom_file", metavar="FILE.toml", help="A boom of your own; else the third generation.")
_catalogue_option = click.option(
    "--catalogue",
    metavar="FILE.toml",
    expose_value=False,
    callback=lambda context, _, value: context.meta.update({_CATALOGUE: value}),
    help="Motors, gearboxes and actuators of your own, beside the shipped ones.",
)


def boom_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """--boom, and --catalogue, which `load_boom` finds in the context: whoever names a drive may have brought it."""
    return _boom_option(_catalogue_option(command))


def plausible(quantity: Range) -> Callable[[click.Context, click.Parameter, Any], Any]:
    """Callback of an option whose number must be within the bounds of a quantity; None passes."""

    def held(_: click.Context, parameter: click.Parameter, value: Any) -> Any:
        if value is not None:
            quantity.require(str(parameter.name).replace("_", "-"), value)
        return value

    return held


payload_option = click.option("--payload", type=float, metavar="KG", help="Mass at the tip; else the boom's own.")
payload_as_option = click.option(
    "--payload-as", type=click.Choice(["mass", "force"]), default="mass", show_default=True,
    help="Accelerate the payload with the tip, or hang its weight there and leave out its inertia, as the thesis does.",
)  # fmt: skip
json_option = click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output, in SI.")
report_option = click.option(
    "--report", "document", metavar="FILE.md|.html|.pdf", help="The report as a document, with pictures, versions and command."
)
vehicle_option = click.option(
    "--vehicle",
    metavar="CASE",
    help="What the vehicle does meanwhile: slope, track, shock, ditch or a FILE.toml; else it rests.",
)
picture_option = click.option("--picture", metavar="FILE.png", help="The drives as a page of pictures.")
pitch_option = click.option(
    "--pitch",
    default="down",
    show_default=True,
    metavar="down|level|up|free|DEG",
    help="Elevation of the end effector at a tip target; free lets the hold choose it.",
)
hold_option = click.option(
    "--hold",
    default="horizontal",
    show_default=True,
    metavar="HOLD",
    help=f"Extra constraint of a tip target: {CONSTRAINTS}.",
)


def given_catalogue() -> str | None:
    """What --catalogue names."""
    name: str | None = click.get_current_context().meta.get(_CATALOGUE)
    return name


def load_boom(boom_file: str | None, payload: float | None = None) -> Boom:
    """The boom of --boom and --catalogue, with the payload of --payload."""
    boom = Boom.load(boom_file, given_catalogue())
    return boom if payload is None else boom.with_payload(payload)


def load_vehicle(vehicle: str | None) -> "VehicleCase":
    """The case of --vehicle; else the vehicle rests on level ground."""
    from planner.motion.vehicle import LEVEL, load_case

    return LEVEL if vehicle is None else load_case(vehicle)


def check_picture(picture: str | None) -> None:
    """Whether the drives' page can have that name, before the work."""
    if picture is not None and not picture.endswith(".png"):
        raise InputError(f"{picture}: the drives' page is written as .png")


def outputs(*files: str | None, document: str | None = None, inputs: Iterable[str | None] = ()) -> "Outputs":
    """What the command writes, its report last, checked before the work; see `Outputs`.

    Raises:
        InputError: as `Outputs`, a report cannot have that name, or a file has the name of one of its pictures.
    """
    from planner.files import Outputs
    from planner.reports.document import is_picture_of, require_form

    read = [*inputs, given_catalogue()]
    if document is not None:
        require_form(document)
        for other in (*files, *read):
            if other is not None and is_picture_of(document, other):
                raise InputError(f"{other}: the report {document} would write a picture there")
    return Outputs(*files, document, inputs=read)
