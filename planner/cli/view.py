"""The command that shows a recording in the Rerun viewer or in a browser."""

import os
import subprocess
import sys
from pathlib import Path
from urllib.parse import quote

import click

from boom_model import InputError

_MAGIC = (b"RRF", b"RRIO")
_LOOPBACK = "127.0.0.1"


@click.command()
@click.argument("recording", metavar="[FILE.rrd]", type=click.Path(), required=False)
@click.option("--web", is_flag=True, help="Serve the web viewer on the loopback address of this machine, and print the link.")
def view(recording: str | None, web: bool) -> int:
    """Open a recording in the Rerun viewer. Default: the newest one in this folder.

    \b
    Examples:
      boom view
      boom view move.rrd --web
    """
    return show(newest_recording() if recording is None else recording, web)


def show(recording: str, web: bool = False) -> int:
    """Open a recording and wait until the viewer is closed; return the viewer's exit code.

    Args:
        recording: the file.
        web: serve the web viewer on the loopback address, and print its link.

    Raises:
        InputError: the file does not exist or is not a recording, or the machine has no screen.
    """
    require_recording(recording)
    if web:
        return _serve(recording)
    require_screen()
    return subprocess.run([sys.executable, "-m", "rerun", "--bind", _LOOPBACK, recording], check=False).returncode


def require_screen() -> None:
    """Check that the machine has a screen.

    Raises:
        InputError: neither DISPLAY nor WAYLAND_DISPLAY is set on Linux.
    """
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise InputError("this machine has no screen; boom view --web serves the recording to a browser")


def newest_recording() -> str:
    """Return the name of the newest recording in the working directory.

    Raises:
        InputError: there is none.
    """
    found = sorted(Path().glob("*.rrd"), key=lambda path: path.stat().st_mtime)
    if not found:
        raise InputError("no recording (.rrd) here; boom plan transport phenotyping makes one")
    return str(found[-1])


def require_recording(name: str) -> None:
    """Check that a file is a Rerun recording.

    Raises:
        InputError: the file cannot be read, or does not start like a recording.
    """
    try:
        with open(name, "rb") as file:
            begins = file.read(4)
    except OSError as error:
        raise InputError(f"{name}: cannot be read: {error.strerror}") from None
    if not begins.startswith(_MAGIC):
        raise InputError(f"{name}: not a Rerun recording; recordings end in .rrd")


def _serve(recording: str) -> int:
    stream, page = _free_ports(2)
    source = quote(f"rerun+http://{_LOOPBACK}:{stream}/proxy", safe="")
    click.echo(f"http://{_LOOPBACK}:{page}?url={source}")
    click.echo("Ctrl-C ends it")
    sys.stdout.flush()
    command = [sys.executable, "-m", "rerun", "--serve-web", "--bind", _LOOPBACK]
    command += ["--port", str(stream), "--web-viewer-port", str(page), recording]
    return subprocess.run(command, check=False, stderr=subprocess.DEVNULL).returncode


def _free_ports(count: int) -> list[int]:
    """Return unused ports of the loopback address."""
    import socket

    sockets = [socket.create_server((_LOOPBACK, 0)) for _ in range(count)]
    ports = [each.getsockname()[1] for each in sockets]
    for each in sockets:
        each.close()
    return ports
