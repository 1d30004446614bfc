"""Whole files or none."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from boom_model import InputError
from planner.files import Outputs, discard, replacing
from tests.builders import hidden


def test_new_file_takes_the_place_of_the_old_one(tmp_path):
    path = tmp_path / "out.txt"
    path.write_text("old")
    with replacing(path) as temporary:
        assert os.path.dirname(os.path.dirname(temporary)) == str(tmp_path)
        with open(temporary, "w") as file:
            file.write("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert os.listdir(tmp_path) == ["out.txt"]


def test_failure_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "out.txt"
    path.write_text("old")
    with pytest.raises(ZeroDivisionError), replacing(path) as temporary, open(temporary, "w") as file:
        file.write(f"half{1 / 0}")
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["out.txt"]


@pytest.mark.parametrize("name", ["missing/out.txt", "."])
def test_place_that_cannot_be_written_is_named(name, tmp_path):
    with pytest.raises(InputError, match="cannot be written"), replacing(tmp_path / name):
        pass


def test_a_link_stays_and_its_target_is_replaced(tmp_path):
    (tmp_path / "target.txt").write_text("old")
    (tmp_path / "link.txt").symlink_to("target.txt")
    with replacing(tmp_path / "link.txt") as temporary, open(temporary, "w") as file:
        file.write("new")
    assert (tmp_path / "link.txt").is_symlink()
    assert (tmp_path / "target.txt").read_text() == "new"


def test_what_is_no_regular_file_is_left_alone(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="no regular file"), replacing(tmp_path / "pipe"):
        pass


def test_disk_that_refuses_is_an_input_error(tmp_path):
    with pytest.raises(InputError, match="No space left"), replacing(tmp_path / "out.txt"):
        raise OSError(28, "No space left on device")
    assert os.listdir(tmp_path) == []


def test_files_of_one_command_appear_together(tmp_path):
    (tmp_path / "sub").mkdir()
    first, second = tmp_path / "a.txt", tmp_path / "sub" / "b.txt"
    files = Outputs(first, None, second)
    assert hidden(tmp_path) == []
    with files:
        for path in (first, second):
            with replacing(files.temporary(path)) as temporary, open(temporary, "w") as file:
                file.write(path.name)
        with open(os.path.join(os.path.dirname(files.temporary(first)), "a-1.png"), "w") as file:
            file.write("beside")
        assert [name for name in os.listdir(tmp_path) if name[0] != "."] == ["sub"]
        assert len(hidden(tmp_path)) == 1
    assert (first.read_text(), second.read_text(), (tmp_path / "a-1.png").read_text()) == ("a.txt", "b.txt", "beside")
    assert hidden(tmp_path) == hidden(tmp_path / "sub") == []


def test_one_that_fails_leaves_none(tmp_path):
    files = Outputs(tmp_path / "a.txt", tmp_path / "b.txt")

    def write():
        with files:
            with open(files.temporary(tmp_path / "a.txt"), "w") as file:
                file.write("a")
            with replacing(files.temporary(tmp_path / "b.txt")):
                raise OSError(28, "No space left on device")

    with pytest.raises(InputError) as refused:
        write()
    assert str(refused.value) == f"{tmp_path / 'b.txt'}: cannot be written: No space left on device"
    assert os.listdir(tmp_path) == []


def test_a_folder_in_the_place_of_one_leaves_all_as_they_were(tmp_path):
    files = Outputs(tmp_path / "a.txt", tmp_path / "b.txt")

    def write():
        with files:
            for name in ("a.txt", "b.txt"):
                with open(files.temporary(tmp_path / name), "w") as file:
                    file.write(name)
            (tmp_path / "b.txt").mkdir()

    with pytest.raises(InputError, match=r"b\.txt: cannot be written: it is no regular file"):
        write()
    assert os.listdir(tmp_path) == ["b.txt"]


def test_a_file_that_is_read_is_not_written(tmp_path):
    (tmp_path / "in.txt").write_text("in")
    (tmp_path / "link.txt").symlink_to("in.txt")
    for name in ("in.txt", "link.txt"):
        with pytest.raises(InputError, match=f"{name}: cannot be written: the same command reads it"):
            Outputs(tmp_path / name, inputs=(None, tmp_path / "in.txt"))


def test_what_a_dead_process_left_goes_with_the_next_write_and_a_living_ones_stays(tmp_path):
    killed = "import os; from planner.files import Outputs; Outputs('dead.txt').__enter__(); os.kill(os.getpid(), 9)"
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])}
    assert subprocess.run([sys.executable, "-c", killed], cwd=tmp_path, env=environment, check=False).returncode == -9
    (left,) = hidden(tmp_path)
    with Outputs(tmp_path / "a.txt") as alive:
        own = os.path.basename(os.path.dirname(alive.temporary(tmp_path / "a.txt")))
        assert hidden(tmp_path) == [own] != [left]
        with replacing(tmp_path / "b.txt") as temporary, open(temporary, "w") as file:
            file.write("b")
        assert hidden(tmp_path) == [own]
    assert os.listdir(tmp_path) == ["b.txt"]


def test_what_is_unfinished_can_be_discarded(tmp_path):
    with Outputs(tmp_path / "a.txt") as files:
        with open(files.temporary(tmp_path / "a.txt"), "w") as file:
            file.write("half")
        discard()
        assert os.listdir(tmp_path) == []
        os.mkdir(os.path.dirname(files.temporary(tmp_path / "a.txt")))


def test_a_signal_waits_until_all_files_are_in_place(tmp_path, monkeypatch):
    names = ("a.txt", "b.txt")
    files, seen = Outputs(*(tmp_path / name for name in names)), []
    replace = os.replace

    def interrupted(*arguments):
        replace(*arguments)
        signal.raise_signal(signal.SIGTERM)

    before = signal.signal(
        signal.SIGTERM, lambda *_: seen.append(sorted(name for name in os.listdir(tmp_path) if name[0] != "."))
    )
    try:
        with files:
            for name in names:
                with open(files.temporary(tmp_path / name), "w") as file:
                    file.write(name)
            monkeypatch.setattr("os.replace", interrupted)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert seen == [[*names]] * 2
