"""The command `boom`: parses arguments and prints results.

Each command imports the modules that are slow to import itself.
"""

import errno
import os
import sys

import click

from boom_model import InputError
from planner.cli import control, drives, files, kinematics, link, moves
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


@click.group(context_settings={"help_option_names": ["-h", "--help"]}, no_args_is_help=False)
@click.version_option(package_name="boom", prog_name="boom")
def cli() -> None:
    """Plan, check and record moves of the third-generation phenotyping boom.

    Angles are in degrees and lengths in metres; files and JSON are in SI.
    """


for _command in (
    moves.plan,
    moves.profiles,
    moves.check,
    moves.torque,
    kinematics.ik,
    kinematics.reach,
    drives.mission,
    drives.size,
    control.control,
    link.link,
    files.export,
    files.export_model,
    files.compare,
    files.validate,
    files.view,
):
    _command.params.append(
        click.Option(["-q", "--quiet"], is_flag=True, expose_value=False, callback=quieten, help="Print errors only.")
    )
    cli.add_command(_command)
