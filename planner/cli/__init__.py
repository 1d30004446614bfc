"""The command `boom`: parses arguments and prints results.

Each command imports the modules that are slow to import itself.
"""

import errno
import os
import sys
from difflib import get_close_matches
from itertools import takewhile

import click

from boom_model import InputError
from planner.cli import (
    compare,
    control,
    data,
    drives,
    experiments,
    files,
    geotag,
    identify,
    kinematics,
    link,
    moves,
    page,
    plots,
    require,
    scan,
    study,
    view,
)
from planner.cli.failures import failure
from planner.cli.printing import quieten


def main() -> None:
    """Run the command and exit.

    The exit code is 0 if all is well, 1 if the answer is no, 2 for bad input, 130 if interrupted,
    and 70 for an internal error. Every code but 0 comes with one line on standard error.
    """
    try:
        if sys.stdout is None:
            raise InputError("standard output is closed")
        code = cli.main(prog_name="boom", standalone_mode=False)
        sys.stdout.flush()
    except SystemExit as stop:  # by click: after shell completion, and with 1 if the reader of a pipe has gone
        code = failure(BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE))) if stop.code else 0
    except (Exception, KeyboardInterrupt) as error:
        code = failure(error)
    sys.exit(code)


_QUESTIONS = """\
Can the boom make a move, and are its drives strong enough?
  boom plan transport phenotyping
Which motors and gearboxes suit a day in the field?
  boom size field-day
How light may a link be?
  boom link

`boom info` shows the boom, `boom --help` every command."""


class _Commands(click.Group):
    """Group of commands that refuse unknown options.

    Several commands accept negative numbers as arguments. Without this class, click would pass
    their unknown options on as arguments.
    """

    def resolve_command(self, ctx: click.Context, args: list[str]) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the name of the command, the command, and its arguments.

        Raises:
            click.NoSuchOption: the option is unknown; the message suggests the nearest one.
        """
        name, command, rest = super().resolve_command(ctx, args)
        if command is not None:
            known = ["--help", *(text for param in command.params for text in (*param.opts, *param.secondary_opts))]
            for text in takewhile(lambda arg: arg != "--", rest):
                option = text.partition("=")[0]
                if option.startswith("--") and option not in known:
                    raise click.NoSuchOption(option, possibilities=get_close_matches(option, known, n=1))
                if option.startswith("-") and f"-{option}" in known:  # a word of letters behind one hyphen
                    raise click.NoSuchOption(option, possibilities=[f"-{option}"])
        return name, command, rest


@click.group(
    cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]}, no_args_is_help=False, invoke_without_command=True
)
@click.version_option(package_name="boom", prog_name="boom")
@click.pass_context
def cli(ctx: click.Context) -> None:
    """Plan, check and record moves of the third-generation phenotyping boom.

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
    require.require,
    study.study,
    control.control,
    geotag.geotag,
    geotag.rig,
    plots.plots,
    scan.scan,
    link.link,
    files.export,
    files.export_model,
    compare.compare,
    experiments.calibrate,
    identify.identify,
    files.validate,
    view.view,
    page.jog,
    data.info,
    data.catalogue,
    data.new,
):
    _command.params.append(
        click.Option(["-q", "--quiet"], is_flag=True, expose_value=False, callback=quieten, help="Print errors only.")
    )
    cli.add_command(_command)
