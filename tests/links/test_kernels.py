"""The same link whatever kernels OpenBLAS picks for the processor."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

KERNELS = ("Haswell", "SkylakeX", "Sandybridge")

DESIGN = """
import json
from dataclasses import replace
from boom_model import Boom, Catalogue
from planner.links.design import default_moves, design_link
from planner.links.task import LinkTask

boom, found = Boom.load(), []
no_motors = replace(Catalogue.load(), motors={})
for task in (LinkTask(), LinkTask(load="thesis"), LinkTask(load="thesis", method="thesis")):
    design = design_link(boom, task, default_moves(boom, task), no_motors)
    found.append((design.mass, None if design.exact is None else design.exact.gap))
print(json.dumps(found))
"""


@pytest.fixture(scope="module")
def designs():
    """Masses and gaps of `boom link`, with the thesis's load, and by the thesis's method, under
    each kernel."""
    command = [sys.executable, "-c", DESIGN]
    environments = [os.environ | {"OPENBLAS_CORETYPE": kernel, "OPENBLAS_NUM_THREADS": "1"} for kernel in KERNELS]
    root = Path(__file__).parents[2]
    started = [subprocess.Popen(command, cwd=root, env=each, stdout=subprocess.PIPE, text=True) for each in environments]
    answers = [process.communicate()[0] for process in started]
    assert [process.returncode for process in started] == [0] * len(KERNELS)
    return [json.loads(answer) for answer in answers]


def test_the_mass_does_not_depend_on_the_kernel(designs):
    masses = [[mass for mass, _ in found] for found in designs]
    assert masses[0] == pytest.approx([2.2025503, 3.7242864, 3.7262047], rel=3e-8)
    assert masses[1] == pytest.approx(masses[0], rel=2e-12)
    assert masses[2] == pytest.approx(masses[0], rel=2e-12)


def test_the_bound_is_proven_under_every_kernel(designs):
    for found in designs:
        of_moves, of_thesis_load, of_thesis_method = (gap for _, gap in found)
        assert 0.0 <= of_moves <= 2e-10
        assert 0.0 <= of_thesis_load <= 2e-10
        assert of_thesis_method is None
