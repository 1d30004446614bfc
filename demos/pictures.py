"""Make the pictures of the guide: recordings drawn by the Rerun viewer without a screen.

Run it as `python demos/pictures.py`. With `--check` it writes nothing, and fails if a picture in
the guide is not what the viewer draws, or the viewer complains. It needs Vulkan; Debian's
mesa-vulkan-drivers will do.
"""

import io
import socket
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image
from rerun.experimental import ViewerClient

FOLDER = Path(__file__).parent / "pictures"
PICTURES = {
    "panel": ("plan transport phenotyping --out {}", 2.5),
    "profiles": ("profiles transport phenotyping --out {}", 2.5),
    "control": ("control transport phenotyping --out {}", 3.0),
    "mission": ("mission table-3-1 --out {}", 2.5),
}
WIDTH = 1200  # [pixels]
ALIKE = 6.0
"""Mean difference of two pictures, of 255, below which they show the same."""


def main() -> int:
    """Make or check every picture; return 1 if one is not as it should be."""
    check, wrong = "--check" in sys.argv[1:], []
    with tempfile.TemporaryDirectory() as folder:
        for name, (command, seconds) in PICTURES.items():
            recording, place = Path(folder) / f"{name}.rrd", FOLDER / f"{name}.png"
            subprocess.run([sys.executable, "-m", "planner", *command.format(recording).split(), "--quiet"], check=True)
            picture, complaints = drawn(recording, seconds)
            wrong += [f"{name}: {each}" for each in complaints]
            if not check:
                picture.save(place, optimize=True)
            elif difference(picture, Image.open(place)) > ALIKE:
                wrong.append(f"{place.name}: is not what the viewer draws; python demos/pictures.py makes it")
    print("\n".join(wrong) or f"{len(PICTURES)} pictures are what the viewer draws")
    return 1 if wrong else 0


def drawn(recording: Path, seconds: float) -> tuple[Image.Image, list[str]]:
    """Return a picture of a recording at a time, and what the viewer complained of."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    with ViewerClient.spawn(headless=True, port=port) as viewer:
        viewer.open(str(recording))
        viewer.set_time("t", duration=seconds, play_state="paused")
        before, png = b"", viewer.take_screenshot()
        for _ in range(10):  # until the picture has settled
            if png == before:
                break
            before, png = png, viewer.take_screenshot()
        logs = viewer.get_logs()
    told = [f"{each.level}: {each.message}" for each in logs if each.level in ("ERROR", "WARN")]
    picture = Image.open(io.BytesIO(png)).convert("RGB")
    small = picture.resize((WIDTH, round(picture.height * WIDTH / picture.width)), Image.Resampling.LANCZOS)
    return small.quantize(256), [each for each in told if "Software rasterizer" not in each]


def difference(one: Image.Image, other: Image.Image) -> float:
    """Return the mean absolute difference of two pictures, infinite if their sizes differ."""
    if one.size != other.size:
        return float("inf")
    first, second = (np.asarray(each.convert("RGB"), dtype=float) for each in (one, other))
    return float(np.abs(first - second).mean())


if __name__ == "__main__":
    sys.exit(main())
