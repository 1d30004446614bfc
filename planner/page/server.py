"""The page's server: on the loopback address alone, with a session for each tab."""

import io
from contextlib import redirect_stdout

import viser

from planner.page.session import Session
from planner.page.state import State

LOOPBACK = "127.0.0.1"


class _Local(viser.ViserServer):
    """A server that never asks for an address outside: viser lets any tab request a public link."""

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Return None: nothing is shared."""
        return None


class Page:
    """A running server. `address` is what a browser opens."""

    def __init__(self, first: State, port: int = 0) -> None:
        """Serve the page.

        Args:
            first: state that each tab begins with.
            port: on the loopback address; 0 takes a free one.
        """
        with redirect_stdout(io.StringIO()):  # viser prints a panel of its own
            self._server = _Local(host=LOOPBACK, port=port, verbose=False)
        self.sessions: dict[int, Session] = {}
        self.address = f"http://{LOOPBACK}:{self._server.get_port()}"

        async def begin(client: viser.ClientHandle) -> None:
            self.sessions[client.client_id] = Session(client, first)

        async def end(client: viser.ClientHandle) -> None:
            session = self.sessions.pop(client.client_id, None)
            if session is not None:
                session.close()

        self._server.on_client_connect(begin)
        self._server.on_client_disconnect(end)

    def wait(self) -> None:
        """Serve until the process is interrupted."""
        self._server.sleep_forever()

    def stop(self) -> None:
        """End the server."""
        self._server.stop()
