"""The interactive page."""

import sys
import webbrowser
from importlib.util import find_spec

import click

from boom_model import InputError
from planner.cli.options import boom_option, given_catalogue, load_boom, payload_option

_PORTS = (0, 65535)


@click.command()
@payload_option
@click.option("--port", type=int, default=0, metavar="PORT", help="Port of the loopback address; otherwise a free one.")
@click.option("--no-browser", is_flag=True, help="Print the address only.")
@boom_option
def jog(payload: float | None, port: int, no_browser: bool, boom_file: str | None) -> int:
    """Open a page to move the boom by hand, with live torques and reach, and to plan from there.

    The page is served on this machine's loopback address only. It needs the extra page.

    \b
    Examples:
      boom jog
      boom jog --payload 8 --no-browser
    """
    if not _PORTS[0] <= port <= _PORTS[1]:
        raise InputError(f"port is {port}; it must be between {_PORTS[0]} and {_PORTS[1]}")
    boom = load_boom(boom_file)
    if find_spec("viser") is None:
        raise InputError("boom jog needs the extra page: pip install 'boom[page]'")
    from planner.page.server import Page
    from planner.page.state import first_state

    page = Page(first_state(boom, boom_file, given_catalogue(), payload), port)
    click.echo(page.address)
    click.echo("Ctrl-C ends it")
    sys.stdout.flush()
    if not no_browser:
        webbrowser.open(page.address)
    page.wait()
    return 0
