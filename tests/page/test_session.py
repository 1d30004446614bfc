"""Tabs of a running page, without a browser: displayed numbers, events, jobs, and who
may reach it."""

import socket
import time

import numpy as np
import pytest

from boom_model import Boom, forward_kinematics, inverse_dynamics
from planner.page import downloads
from planner.page.jobs import Worker
from planner.page.server import LOOPBACK, Page
from planner.page.state import edited, first_state
from tests.page.tab import Tab


@pytest.fixture(scope="module")
def page():
    running = Page(first_state(Boom.load()))
    yield running
    running.stop()


@pytest.fixture
def tab(page):
    with Tab(page.address) as connected:
        connected.settle()
        yield connected


def session(page):
    """The session of the newest tab."""
    return page.sessions[max(page.sessions)]


def test_the_numbers_are_the_librarys_to_the_printed_digits(tab):
    boom = Boom.load()
    for label, value in (("yaw [deg]", 30.0), ("inner [deg]", 70.0), ("lower [deg]", 150.5), ("extension [m]", 0.3)):
        tab.put(label, value)
    tab.put("payload [kg]", "8")
    tab.until(lambda: "--payload 8" in tab.html)
    q = np.array([np.radians(30.0), np.radians(70.0), np.radians(150.5), 0.3, 0.0])
    carrying = boom.with_payload(8.0)
    loads = inverse_dynamics(carrying, q, np.zeros(5), np.zeros(5))
    for axis, value in zip("xyz", forward_kinematics(boom, q).position, strict=True):
        assert tab.shown(f"tip_{axis}") == f"{value:.4f}"
    assert tab.shown("torque_inner") == f"{loads.tau[1]:.2f}"
    assert tab.shown("torque_lower") == f"{loads.tau[2]:.2f}"
    assert tab.shown("mount_Fz") == f"{loads.mount[2]:.1f}"
    assert tab.shown("pin_8") == f"{np.linalg.norm(loads.pins.frame_8):.1f}"
    assert "--payload 8" in tab.html


def test_a_refused_value_is_said_below_its_field_and_goes_when_it_is_put_right(tab):
    before = tab.shown("torque_inner")
    tab.put("payload [kg]", "nan")
    tab.until(lambda: tab.complaint("payload"))
    assert tab.complaint("payload") == "payload: &#x27;nan&#x27; must be finite"
    tab.put("lower [deg]", 20.0)
    tab.until(lambda: tab.complaint("lower"))
    assert tab.shown("torque_inner") == before
    tab.put("inner [deg]", 10.0)
    tab.put("payload [kg]", "10")
    tab.until(lambda: not tab.complaint("payload") and not tab.complaint("lower"))
    assert tab.shown("torque_inner") != before


def test_dragging_the_gizmo_moves_the_tip_with_it(tab):
    tab.drag((1.4, 0.2, 1.0))
    tab.until(lambda: tab.number("tip_x") == pytest.approx(1.4))
    assert (tab.number("tip_y"), tab.number("tip_z")) == (0.2, 1.0)
    assert tab.shown("branches") is not None
    tab.drag((4.0, 0.2, 1.0))
    tab.until(lambda: tab.complaint("x"))
    assert tab.number("tip_x") == pytest.approx(1.4)


def test_plan_play_and_save(page, tab):
    tab.put("payload [kg]", "8")
    tab.put("Plan", True)
    tab.until(lambda: "INCOMPLETE" in (tab.shown("verdict") or ""))
    tab.put("t [s]", 2.5)
    tab.until(lambda: tab.shown("now") == "2.500")
    tab.put("Play", True)
    tab.until(lambda: tab.shown("now") == "5.000")
    state = session(page).state
    groups = [uuid for uuid, each in tab.elements.items() if each.get("label") == "save"]
    for uuid, kind in ((groups[0], "csv"), (groups[1], "mission")):
        tab._send({"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": kind}})
        name = downloads.files_of(state)[kind]
        tab.until(lambda name=name: tab.files.get(name))
        assert tab.files[name] == downloads.content(state, kind)


def test_a_swapped_drive_is_planned_again_and_the_verdict_changes(tab):
    tab.put("payload [kg]", "8")
    tab.put("Plan", True)
    tab.until(lambda: "INCOMPLETE" in (tab.shown("verdict") or ""))
    tab.put("lower", "MST340B02 + CBG320160")
    tab.until(lambda: "FAIL: lower" in (tab.shown("verdict") or ""))
    tab.put("lower", "MST342C02 + CBG320160")
    tab.until(lambda: "INCOMPLETE" in (tab.shown("verdict") or ""))


def test_two_tabs_do_not_mix(page):
    with Tab(page.address) as one, Tab(page.address) as two:
        one.put("inner [deg]", 30.0)
        one.until(lambda: one.number("torque_inner") != two.number("torque_inner"))
        kept = two.shown("torque_inner")
        two.put("roll [deg]", "5")
        two.until(lambda: two.number("mount_Fy") != 0.0)
        one.settle()
        assert one.number("mount_Fy") == 0.0
        assert two.shown("torque_inner") != kept  # of its own slope
        assert two.number("tip_y") == pytest.approx(2.2895)


def test_a_closed_tab_ends_its_work(page):
    with Tab(page.address) as tab:
        own = session(page)
        tab.put("constraint", "least-torque")
        tab.settle()
        tab.put("workspace", "show")
        tab.until(lambda: "mapping" in tab.html)
        assert own._worker.is_busy
    end = time.monotonic() + 10.0
    while own in page.sessions.values() and time.monotonic() < end:
        time.sleep(0.02)
    assert own not in page.sessions.values()
    assert not own._worker.is_busy
    assert own.state.workspace is None


def test_a_thousand_random_events_leave_no_exception(page, capfd):
    rng = np.random.default_rng(19)
    texts = ["", "nan", "-inf", "1e99", "0", "5", "12.5", "down", "free", "transport", "tip=1.4,0,1", "<b>", "q=0,0,30,0,0"]
    with Tab(page.address) as tab:
        own = session(page)
        tab.settle()
        fields = [each for each in tab.elements.items() if each[1]["type"] in ("GuiSliderMessage", "GuiTextMessage")]
        for k in range(1000):
            uuid, props = fields[rng.integers(len(fields))]
            if props["type"] == "GuiSliderMessage":
                value = float(rng.choice([np.nan, np.inf, *rng.uniform(-400.0, 400.0, 6)]))
            elif props["label"] in ("pitch", "constraint"):
                value = "level" if props["label"] == "pitch" else str(rng.choice(["horizontal", "extension=0.2", "x"]))
            else:
                value = texts[rng.integers(len(texts))] if rng.random() < 0.5 else f"{rng.uniform(-3.0, 3.0):.3f}"
            tab._send({"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": value}})
            if k % 100 == 99:
                tab.drag(tuple(rng.uniform(-2.0, 2.0, 3)))
                tab.settle(0.05)
        tab.settle(1.0)
        assert own.state.boom.limits.contain(own.state.q)
        tab.put("go to", "transport")
        tab.until(lambda: tab.number("tip_y") == 0.0)
        assert not [note for note in tab.notes if "Internal" in note["title"]]
    assert "Traceback" not in capfd.readouterr().err


def test_only_the_loopback_address_is_served(page):
    sockets = page._server._websock_server
    assert sockets._host == LOOPBACK
    port = page._server.get_port()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect(("192.0.2.1", 9))  # sends nothing; tells the machine's own address
        own = probe.getsockname()[0]
    if own != LOOPBACK:
        with pytest.raises(OSError, match=r"refused|timed out"):
            socket.create_connection((own, port), timeout=2.0)


def test_nothing_is_shared(page, tab):
    tab._send({"type": "ShareUrlRequest"})
    tab.settle()
    assert page._server.request_share_url() is None
    assert page._server._share_tunnel is None


async def _counted(worker, said):
    await worker.run("counting", lambda track: sum(track([1, 2, 3])), said.append, said.append)


def test_a_job_tells_its_result_once():
    import asyncio

    shares, said = [], []
    worker = Worker(lambda title, share: shares.append((title, share)))
    asyncio.run(_counted(worker, said))
    assert said == [6]
    assert shares[0] == ("counting", 0.0)
    assert shares[-1] == ("", None)
    assert not worker.is_busy


def test_every_tab_begins_with_the_first_state(page):
    with Tab(page.address) as tab:
        first = first_state(Boom.load())
        assert edited(first, "yaw", "90").joints == session(page).state.joints
        assert tab.elements[tab.uuid("start")]["value"] == "transport"
