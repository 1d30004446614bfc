"""A tab of the page without a browser: it speaks the protocol of viser's client over
a WebSocket."""

import re
import time
from typing import Any

import msgspec
import viser
import zstandard
from websockets.sync.client import connect

_CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": [1.0, 0.0, 0.0, 0.0],
    "position": [3.0, 3.0, 3.0],
    "fov": 0.75,
    "near": 0.1,
    "far": 100.0,
    "image_height": 720,
    "image_width": 1280,
    "look_at": [0.0, 0.0, 0.0],
    "up_direction": [0.0, 0.0, 1.0],
}


class Tab:
    """What a tab has been told by the server: elements by uuid, nodes of the scene, whole files,
    notifications."""

    def __init__(self, address: str) -> None:
        self.elements: dict[str, dict[str, Any]] = {}
        self.nodes: dict[str, dict[str, Any]] = {}
        self.notes: list[dict[str, Any]] = []
        self.files: dict[str, bytes] = {}
        self._coming: dict[str, tuple[str, int, bytes]] = {}
        self._socket = connect(
            address.replace("http", "ws"), subprotocols=[f"viser-v{viser.__version__}"], max_size=None, compression=None
        )
        self._send(_CAMERA)
        self.until(lambda: self.number("tip_x") is not None)

    def close(self) -> None:
        self._socket.close()

    def __enter__(self) -> "Tab":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _send(self, message: dict[str, Any]) -> None:
        self._socket.send(msgspec.msgpack.encode(message))

    def uuid(self, label: str) -> str:
        """The element of a label."""
        return next(uuid for uuid, each in self.elements.items() if each.get("label") == label)

    def put(self, label: str, value: object) -> None:
        """Change a field, or press a button of a group."""
        self._send({"type": "GuiUpdateMessage", "uuid": self.uuid(label), "updates": {"value": value}})

    def drag(self, position: tuple[float, float, float]) -> None:
        """Drag the gizmo of the target."""
        name = next(name for name in self.nodes if name.endswith("/target"))
        for phase in ("DragStart", "Update", "DragEnd"):
            message = {"type": f"TransformControls{phase}Message", "name": name, "owner": self.nodes[name]["owner"]}
            if phase == "Update":
                message |= {"wxyz": [1.0, 0.0, 0.0, 0.0], "position": [float(x) for x in position]}
            self._send(message)

    def receive(self, timeout: float) -> None:
        """Take one window of messages."""
        raw = self._socket.recv(timeout=timeout)
        size = int.from_bytes(raw[8:16], "little")
        whole = msgspec.msgpack.decode(zstandard.ZstdDecompressor().decompress(raw[16 : 16 + size]))
        end = 16 + size
        buffers = []
        for length in whole["binaryBufferLengths"]:
            end += -end % 8
            buffers.append(raw[end : end + length])
            end += length
        for message in whole["messages"]:
            self._take(message, buffers)

    def _take(self, message: dict[str, Any], buffers: list[bytes]) -> None:
        kind = message["type"]
        if kind == "GuiUpdateMessage":
            self.elements[message["uuid"]].update(message["updates"])
        elif kind == "GuiRemoveMessage":
            self.elements.pop(message["uuid"], None)
        elif kind == "NotificationShowMessage" or kind == "NotificationMessage":
            self.notes.append(message["props"])
        elif kind == "FileTransferStartDownload":
            self._coming[message["transfer_uuid"]] = message["filename"], message["size_bytes"], b""
        elif kind == "FileTransferPart":
            content = message["content"]
            whole = content if isinstance(content, bytes) else buffers[content["__binary__"]]
            name, size, before = self._coming[message["transfer_uuid"]]
            self._coming[message["transfer_uuid"]] = name, size, before + whole
            if len(before + whole) == size:
                self.files[name] = before + whole
        elif kind.startswith("Gui") and "uuid" in message and "props" in message:
            self.elements[message["uuid"]] = message["props"] | {"type": kind, "value": message.get("value")}
        elif "name" in message:
            self.nodes.setdefault(message["name"], {}).update(message)

    def until(self, holds: Any, seconds: float = 30.0) -> None:
        """Take messages until something holds."""
        end = time.monotonic() + seconds
        while not holds():
            left = end - time.monotonic()
            if left <= 0.0:
                raise TimeoutError("what the test waits for did not come")
            try:
                self.receive(left)
            except TimeoutError:
                raise TimeoutError("what the test waits for did not come") from None

    def settle(self, seconds: float = 0.3) -> None:
        """Take messages until none comes for a while."""
        while True:
            try:
                self.receive(seconds)
            except TimeoutError:
                return

    @property
    def html(self) -> str:
        """All HTML that the tab shows."""
        return "".join(each["content"] for each in self.elements.values() if each["type"] == "GuiHtmlMessage")

    def shown(self, name: str) -> str | None:
        """The text of the HTML element with an identifier."""
        found = re.search(rf'id="{name}"[^>]*>(.*?)</', self.html)
        return None if found is None else found[1]

    def number(self, name: str) -> float | None:
        """The number in the HTML element with an identifier."""
        text = self.shown(name)
        return None if text is None else float(text)

    def complaint(self, name: str) -> str | None:
        """What is said below a field."""
        return self.shown(f"complaint-{name}")
