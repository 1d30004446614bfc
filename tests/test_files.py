"""Whole files or none."""

import os

import pytest

from boom_model import InputError
from planner.files import replacing


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
