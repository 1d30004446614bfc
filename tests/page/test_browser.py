"""The page in Debian's headless Chromium. Run with `pytest -m browser tests/page`.

With PICTURES set to a folder, the pictures of the guide are written there.
"""

import json
import os
import re
import shlex
import shutil
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from boom_model import Boom, forward_kinematics, inverse_dynamics, inverse_kinematics
from planner.page.server import Page
from planner.page.state import first_state

pytestmark = pytest.mark.browser

_ALONE = "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1"  # no name is resolved: the page has no internet
_OPTIONS = ("--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--hide-scrollbars")

NETWORK_LOG = "network.json"


@pytest.fixture(scope="module")
def page():
    running = Page(first_state(Boom.load()))
    yield running
    running.stop()


class Browser:
    """A Chromium with one tab of the page."""

    def __init__(self, address: str, folder: Path, size: tuple[int, int] = (1280, 720)) -> None:
        from selenium import webdriver
        from selenium.common.exceptions import StaleElementReferenceException
        from selenium.webdriver.chrome.service import Service

        chromium, driver = shutil.which("chromium"), shutil.which("chromedriver")
        assert chromium is not None, "chromium is missing: apt-get install chromium"
        assert driver is not None, "chromedriver is missing: apt-get install chromium-driver"
        options = webdriver.ChromeOptions()
        options.binary_location = chromium
        for option in (*_OPTIONS, _ALONE, f"--log-net-log={folder / NETWORK_LOG}"):
            options.add_argument(option)
        options.add_experimental_option("prefs", {"download.default_directory": str(folder)})
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        self.folder = folder
        self.driver = webdriver.Chrome(options=options, service=Service(driver))
        metrics = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        self.driver.get(address)
        self.until(lambda: self.text("tip_x"))
        with suppress(StaleElementReferenceException):  # a notification of the software renderer, which may go by itself
            for close in self.driver.find_elements("css selector", ".mantine-Notification-closeButton"):
                close.click()

    def until(self, holds, seconds: float = 60.0):
        """What holds, as soon as it does."""
        from selenium.common.exceptions import StaleElementReferenceException

        end = time.monotonic() + seconds
        while time.monotonic() < end:
            with suppress(StaleElementReferenceException):  # the panels take their places while the page loads
                found = holds()
                if found:
                    return found
            time.sleep(0.1)
        said = self.driver.find_element("tag name", "body").text
        typed = [each.get_attribute("value") for each in self.driver.find_elements("tag name", "input")]
        raise TimeoutError(f"what the test waits for did not come; the page says {said!r}, its fields hold {typed}")

    def text(self, name: str) -> str | None:
        """The text of an element of the views, as the page has it."""
        return self.driver.execute_script("return document.getElementById(arguments[0])?.textContent ?? null", name)

    def tab(self, title: str) -> None:
        """Go to a tab of a panel."""
        self.press(title, "[role=tab]")

    def press(self, title: str, selector: str = "button") -> None:
        """Press what has a title."""

        def press() -> bool:
            for each in self.driver.find_elements("css selector", selector):
                if each.is_displayed() and each.text.strip() == title:
                    self.driver.execute_script("arguments[0].scrollIntoView({block: 'center'})", each)
                    each.click()
                    return True
            return False

        self.until(press)

    def field(self, label: str):
        """The input of a label."""
        path = f"//label[normalize-space()='{label}']/ancestor::*[.//input][1]//input"
        return self.until(lambda: next((e for e in self.driver.find_elements("xpath", path) if e.is_displayed()), None))

    def slider(self, label: str):
        """The thumb of a slider."""
        path = f"//label[normalize-space()='{label}']/ancestor::*[.//*[@role='slider']][1]//*[@role='slider']"
        return self.until(lambda: next(iter(self.driver.find_elements("xpath", path)), None))

    def type(self, label: str, text: str) -> None:
        """Type into a field, by keyboard."""
        from selenium.webdriver.common.keys import Keys

        def typed() -> bool:
            field = self.field(label)
            if field.get_attribute("value") != text:
                field.send_keys(Keys.CONTROL, "a", Keys.NULL, text)
            return self.field(label).get_attribute("value") == text

        self.until(typed)

    def picture(self, name: str) -> None:
        """Write a picture of the guide, if they are asked for."""
        if os.environ.get("PICTURES"):
            from selenium.webdriver import ActionChains

            ActionChains(self.driver).move_by_offset(640, 700).perform()  # away from what has a hint
            time.sleep(1.0)
            self.driver.save_screenshot(str(Path(os.environ["PICTURES"]) / f"{name}.png"))


@pytest.fixture
def browser(page, tmp_path):
    opened = Browser(page.address, tmp_path)
    yield opened
    opened.driver.quit()


def requests_of_pages(log: Path) -> set[str]:
    """Addresses that a page or its workers asked for, as Chromium's network log has them; not the
    browser's own."""
    whole = json.loads(log.read_text())
    begun = whole["constants"]["logEventTypes"]["URL_REQUEST_START_JOB"]
    asked = [event["params"] for event in whole["events"] if event["type"] == begun and "params" in event]
    return {each["url"] for each in asked if each.get("initiator", "").startswith("http")}


def session(page):
    """The session of the newest tab."""
    return page.sessions[max(page.sessions)]


def test_a_slider_is_moved_by_keyboard_and_the_numbers_follow(page, browser):
    from selenium.webdriver.common.keys import Keys

    before = browser.text("torque_inner")
    browser.slider("inner [deg]").send_keys(Keys.ARROW_LEFT * 5)
    browser.until(lambda: browser.text("torque_inner") != before)
    browser.until(lambda: session(page).state.joints[1] == pytest.approx(59.5))
    boom, q = Boom.load(), session(page).state.q
    loads, tip = inverse_dynamics(boom, q, np.zeros(5), np.zeros(5)), forward_kinematics(boom, q)
    browser.until(lambda: browser.text("torque_inner") == f"{loads.tau[1]:.2f}")
    expected = {f"tip_{a}": f"{v + 0.0:.4f}" for a, v in zip("xyz", np.round(tip.position, 9), strict=True)}
    expected |= {f"mount_F{a}": f"{v + 0.0:.1f}" for a, v in zip("xyz", np.round(loads.mount[:3], 6), strict=True)}
    expected |= {f"pin_{k}": f"{np.linalg.norm(getattr(loads.pins, f'frame_{k}')):.1f}" for k in (6, 7, 8)}
    expected |= {"tip_pitch": f"{np.degrees(tip.pitch):.2f}", "torque_lower": f"{loads.tau[2]:.2f}"}
    assert {name: browser.text(name) for name in expected} == expected


def test_a_target_is_typed_and_an_unreachable_one_is_refused_beside_its_field(page, browser):
    browser.tab("Target")
    for label, text in (("tip x [m]", "1.4"), ("tip y [m]", "0"), ("tip z [m]", "1")):
        browser.type(label, text)
    browser.until(lambda: browser.text("tip_x") == "1.4000" and browser.text("tip_z") == "1.0000")
    found = inverse_kinematics(Boom.load(), (1.4, 0.0, 1.0))
    assert f"{np.degrees(found.solutions[found.best].q[1]):.2f}" in browser.text("branches")
    browser.press("show")
    browser.until(lambda: browser.text("workspace"))
    browser.picture("page-target")
    browser.type("tip x [m]", "nan")
    browser.until(lambda: "must be finite" in (browser.text("complaint-x") or ""))
    browser.type("tip x [m]", "3.4")
    browser.until(lambda: "only outside the limits" in (browser.text("complaint-x") or ""))
    assert browser.text("tip_x") == "1.4000"

    def is_below_its_field() -> bool:
        said = browser.driver.find_element("id", "complaint-x").rect
        typed = browser.field("tip x [m]").rect
        return 0 <= said["y"] - typed["y"] - typed["height"] < 20

    browser.until(is_below_its_field)


def test_plan_play_and_save_as_the_command_does(page, browser, boom):
    browser.type("payload [kg]", "8")
    browser.tab("Drives")
    browser.tab("Move")
    browser.press("Plan")
    browser.tab("Motion")
    browser.until(lambda: "INCOMPLETE" in (browser.text("verdict") or ""))
    browser.press("Play")
    browser.until(lambda: (browser.text("now") or "0") not in ("0", "0.000"))
    browser.until(lambda: browser.text("now") == "5.000")
    planned = session(page).state.planned
    for joint, plane in zip(("inner", "lower"), planned.planes, strict=True):
        assert browser.text(f"motor_{joint}") == f"{plane.torque[-1]:.3f}"
    assert len(browser.driver.find_elements("css selector", ".uplot canvas")) == 2
    browser.press("csv")
    saved = browser.folder / "move.csv"
    browser.until(saved.exists)
    code, _, error = boom(*shlex.split(browser.text("command"))[1:], "--csv", "shell.csv")
    assert code == 0, error
    assert saved.read_bytes() == Path("shell.csv").read_bytes()


def test_a_weaker_drive_fails_and_a_suggestion_is_a_button(page, browser):
    browser.type("payload [kg]", "15")
    browser.tab("Move")
    browser.press("Plan")
    browser.tab("Motion")
    browser.until(lambda: "FAIL" in (browser.text("verdict") or ""))
    browser.press("look for fixes")
    browser.until(lambda: session(page).state.suggestions, 300.0)
    browser.until(lambda: "a payload of 14.2 kg" in browser.driver.find_element("tag name", "body").text)
    browser.picture("page-fixes")
    browser.press("Apply fix 1")
    browser.until(lambda: "INCOMPLETE" in (browser.text("verdict") or ""))
    assert session(page).state.boom.payload.mass < 15.0


def test_nothing_is_asked_of_another_address(page, tmp_path):
    opened = Browser(page.address, tmp_path)
    try:
        opened.tab("Move")
        opened.press("Plan")
        opened.until(lambda: session(page).state.planned)
        messages = [json.loads(entry["message"])["message"] for entry in opened.driver.get_log("performance")]
        asked = [each["params"]["request"]["url"] for each in messages if each["method"] == "Network.requestWillBeSent"]
        assert page.address + "/" in asked
        served = re.compile(r"http://127\.0\.0\.1:\d+/|data:|blob:")
        assert [url for url in asked if not served.match(url)] == []
        assert [entry for entry in opened.driver.get_log("browser") if entry["level"] == "SEVERE"] == []
    finally:
        opened.driver.quit()  # it ends the log of the network, which has what the page's workers ask for too
    assert requests_of_pages(tmp_path / NETWORK_LOG) == {page.address.replace("http", "ws") + "/"}


def test_it_works_on_a_tablet(page, tmp_path):
    tablet = Browser(page.address, tmp_path, (820, 1180))
    try:
        assert tablet.driver.execute_script("return document.documentElement.scrollWidth") <= 820

        def places() -> list[float]:
            tabs = tablet.driver.find_elements("css selector", "[role=tab]")
            return [tab.rect["x"] for tab in tabs if tab.text == "Loads"]

        assert tablet.until(places)[0] < 400  # below the fields, so that the scene keeps more than half of the width
        tablet.type("payload [kg]", "3")
        tablet.until(lambda: session(page).state.boom.payload.mass == 3.0)
    finally:
        tablet.driver.quit()


def test_a_server_that_ended_is_said_in_the_page(tmp_path):
    own = Page(first_state(Boom.load()))
    opened = Browser(own.address, tmp_path)
    try:
        own.stop()
        opened.until(lambda: "Connecting..." in opened.driver.find_element("tag name", "body").text, 30.0)
        assert opened.text("tip_x") == "0.0000"  # the last numbers stay, dimmed
    finally:
        opened.driver.quit()
