"""From a slider's move to the new picture and bars, against an echo on the same connection;
planning against the library.

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

MOVES, ROUNDS, LONGEST = 100, 3, 0.010  # [s]


@pytest.fixture
def page():
    running = Page(first_state(Boom.load()))
    yield running
    running.stop()


def _echo(page, tab):
    """Add a field whose text the server sends back at once; return the place of the answer."""
    (session,) = page.sessions.values()
    client = session._client
    field, answer = client.gui.add_text("echo", ""), client.gui.add_html('<b id="echo"></b>')

    @field.on_update
    async def back(event):
        answer.content = f'<b id="echo">{event.target.value}</b>'
        client.flush()

    tab.settle()
    return _element(tab, "echo")


def _element(tab, name):
    """The place of the view that holds an identifier; looking at it costs the
    measurement nothing."""
    return next(each for each in tab.elements.values() if f'id="{name}"' in (each.get("content") or ""))


def _seconds(tab, label, value, place):
    before, begun = place["content"], time.perf_counter()
    tab.put(label, value)
    tab.until(lambda: place["content"] != before)
    return time.perf_counter() - begun


def test_the_servers_part_of_a_sliders_move_is_at_most_ten_milliseconds(page):
    rng, medians = np.random.default_rng(0), []
    with Tab(page.address) as tab:
        echo, bars = _echo(page, tab), _element(tab, "torque_inner")
        for _ in range(ROUNDS):  # the best of them: what else the machine does only adds
            echoes, moves = [], []
            for _ in range(MOVES):
                echoes.append(_seconds(tab, "echo", f"{rng.random()}", echo))
                moves.append(_seconds(tab, "inner [deg]", round(float(rng.uniform(10.0, 110.0)), 1), bars))
                tab.settle(0.02)
            medians.append((np.median(moves), np.median(echoes)))
    move, echo = min(medians, key=lambda pair: pair[0] - pair[1])
    print(f"a slider's move {1e3 * move:.2f} ms, an echo {1e3 * echo:.2f} ms")
    assert move - echo < LONGEST


def test_the_page_plans_as_fast_as_the_library(page):
    """1.26 to 1.58 were seen: the library takes 15 ms, and drawing what it found 4 to 9 ms more."""
    boom, ratios = Boom.load(), []
    plan(boom, "transport", "phenotyping")  # imports what is slow to import
    with Tab(page.address) as tab:
        for k in range(10):
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
    print(f"page / library: {min(ratios):.2f}")
    assert min(ratios) < 2.0
