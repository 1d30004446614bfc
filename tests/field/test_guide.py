"""The guide's examples in Python are run, and give what is printed."""

import doctest
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_examples_of_the_guide(monkeypatch):
    monkeypatch.chdir(ROOT)
    result = doctest.testfile(str(ROOT / "demos" / "guide" / "field.md"), module_relative=False)
    assert result.attempted > 10
    assert result.failed == 0
