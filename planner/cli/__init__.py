"""The command `boom`: parsing and printing, nothing else. What is slow to import is imported by the command that needs it."""

import errno
import os
import sys
from difflib import get_close_matches
from itertools import takewhile

import click

from boom_model import InputError
from planner.cli import control, data, drives, files, identify, kinematics, link, moves, view
from planner.cli.failures import failure
from planner.cli.printing import quieten


def main() -> None:
    """Run the command; exit 0 done, 1 the answer is no, 2 bad input, 70 an internal error, each but 0 with one line."""
    try:
        if sys.stdout is None:
            raise InputError("standard output is closed")
        code = cli.main(prog_name="boom", standalone_mode=False)
        sys.stdout.flush()
    except SystemExit as stop:  # click ends by itself after shell completion, and, with 1, where a pipe has lost its reader
        code = failure(BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE))) if stop.code else 0
    except (Exception, KeyboardInterrupt) as error:
        code = failure(error)
    sys.exit(code)


_QUESTIONS = """\
Can the boom make a move, and do its drives stand it?
  boom plan transport phenotyping
Which motors and gearboxes do for a day in the field?
  boom size field-day
How light may a link be?
  boom link

`boom info` shows the boom, `boom --help` every command."""


class _Commands(click.Group):
    """Commands that take no option of a name that they do not know.

    Several commands take negative numbers as arguments, so click passes unknown options on to them as arguments.
    """

    def resolve_command(self, ctx: click.Context, args: list[str]) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command's name, the command, and its arguments.

        Raises:
            click.NoSuchOption: the command has no such option; the message suggests the nearest.
        """
        name, command, rest = super().resolve_command(ctx, args)
        if command is not None:
            known = ["--help", *(text for param in command.params for text in (*param.opts, *param.secondary_opts))]
            for text in takewhile(lambda arg: arg != "--", rest):
                option = text.partition("=")[0]
                if option.startswith("--") and option not in known:
                    raise click.NoSuchOption(option, possibilities=get_close_matches(option, known, n=1))
        return name, command, rest


@click.group(
    cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]}, no_args_is_help=False, invoke_without_command=True
)
@click.version_option(package_name="boom", prog_name="boom")
@click.pass_context
def cli(ctx: click.Context) -> None:
    """Plan, check and watch the moves of the third-generation phenotyping boom.

    Angles are in degrees and lengths in metres; files and JSON are in SI.
    """
    if ctx.invoked_subcommand is None:
        click.echo(_QUESTIONS)


for _command in (
    moves.plan,
    moves.profiles,
    moves.check,
    moves.torque,
    kinematics.fk,
    kinematics.ik,
    kinematics.reach,
    drives.mission,
    drives.size,
    control.control,
    link.link,
    files.export,
    files.export_model,
    files.compare,
    identify.identify,
    files.validate,
    view.view,
    data.info,
    data.catalogue,
    data.new,
):
    _command.params.append(
        click.Option(["-q", "--quiet"], is_flag=True, expose_value=False, callback=quieten, help="Print errors alone.")
    )
    cli.add_command(_command)
