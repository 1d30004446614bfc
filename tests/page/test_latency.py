"""From a slider's move to the new picture and bars, against an echo on the same connection; planning against the library.

It is run with the tests in the browser, which have the machine for themselves.
"""

import time

import numpy as np
import pytest

from boom_model import Boom
from planner import plan
from planner.page.server import Page
from planner.page.state import first_state
from tests.page.tab import Tab

pytestmark = pytest.mark.browser

MOVES, LONGEST = 200, 0.010  # [s]


@pytest.fixture
def page():
    running = Page(first_state(Boom.load()))
    yield running
    running.stop()


def _echo(page, tab):
    """Add a field whose text the server sends back at once."""
    (session,) = page.sessions.values()
    client = session._client
    field, answer = client.gui.add_text("echo", ""), client.gui.add_html("")

    @field.on_update
    async def back(event):
        answer.content = f'<b id="echo">{event.target.value}</b>'
        client.flush()

    tab.settle()


def _seconds(tab, label, value, element):
    before, begun = tab.shown(element), time.perf_counter()
    tab.put(label, value)
    tab.until(lambda: tab.shown(element) != before)
    return time.perf_counter() - begun


def test_the_servers_part_of_a_sliders_move_is_at_most_ten_milliseconds(page):
    rng, echoes, moves = np.random.default_rng(0), [], []
    with Tab(page.address) as tab:
        _echo(page, tab)
        for k in range(MOVES):
            echoes.append(_seconds(tab, "echo", str(k), "echo"))
            moves.append(_seconds(tab, "inner [deg]", round(float(rng.uniform(10.0, 110.0)), 1), "torque_inner"))
            tab.settle(0.02)
    own = np.median(moves) - np.median(echoes)
    print(f"a slider's move {1e3 * np.median(moves):.2f} ms, an echo {1e3 * np.median(echoes):.2f} ms")
    assert own < LONGEST


def test_the_page_plans_as_fast_as_the_library(page):
    boom, ratios = Boom.load(), []
    with Tab(page.address) as tab:
        for k in range(5):
            begun = time.perf_counter()
            move = plan(boom.with_payload(5.0 + k), "transport", "phenotyping")
            library = time.perf_counter() - begun
            tab.put("payload [kg]", f"{5 + k}")
            tab.until(lambda: not tab.shown("asked"))
            begun = time.perf_counter()
            tab.put("Plan", True)
            tab.until(lambda k=k: f"payload {5 + k} kg" in (tab.shown("asked") or ""))
            ratios.append((time.perf_counter() - begun) / library)
            assert move.report.verdict in tab.shown("verdict")
    print(f"page / library: {np.median(ratios):.2f}")
    assert np.median(ratios) < 2.0
