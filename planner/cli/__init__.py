"""The command `boom`: parsing and printing, nothing else. What is slow to import is imported by the command that needs it."""

import sys

import click

from boom_model import BoomError, InfeasibleError
from planner.cli import control, drives, files, kinematics, link, moves
from planner.cli.printing import ANSWER_IS_NO, BAD_INPUT, complain, quieten


def main() -> None:
    """Run the command; exit 0 done, 1 the answer is no, 2 bad input with one line on standard error."""
    try:
        code = cli.main(prog_name="boom", standalone_mode=False)
    except click.ClickException as error:
        complain(error.format_message())
        code = BAD_INPUT
    except (MemoryError, OverflowError) as error:
        complain(f"too large to compute: {error}")
        code = BAD_INPUT
    except click.Abort:
        code = 130
    except InfeasibleError as error:
        complain(str(error))
        code = ANSWER_IS_NO
    except BoomError as error:
        complain(str(error))
        code = BAD_INPUT
    sys.exit(code)


@click.group(context_settings={"help_option_names": ["-h", "--help"]}, no_args_is_help=False)
@click.version_option(package_name="boom", prog_name="boom")
def cli() -> None:
    """Plan, check and watch the moves of the third-generation phenotyping boom.

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
        click.Option(["-q", "--quiet"], is_flag=True, expose_value=False, callback=quieten, help="Print errors alone.")
    )
    cli.add_command(_command)
