"""Fixtures that the dynamics' tests share."""

import pytest

from boom_model import Boom
from tests.oracles import BOOMS


@pytest.fixture(params=BOOMS)
def boom(request: pytest.FixtureRequest) -> Boom:
    """Each boom of the oracles in turn."""
    return BOOMS[request.param]
