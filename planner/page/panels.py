"""Panels of the page: fields by name, places of complaints, places of views."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import viser

from boom_model import JOINTS
from boom_model.boom import IS_LENGTH
from boom_model.kinematics.constraints import WORDS
from planner.motion.vehicle import named_cases
from planner.page.drives import offered
from planner.page.html import complaint
from planner.page.state import State, drive_field
from planner.page.vehicle import OWN
from planner.timing.profile import PROFILES

_WIDTH = 340  # [px] of each panel: 600 px of 1280 are left for the scene
_NARROW = 1000  # [px] of a window that has no room for a panel on either side
SAVED = ("recording", "csv", "report", "mission", "boom", "vehicle")
"""Kinds of files, as `downloads.files_of` has them."""

_FLAGS = (
    ("pass_via", "pass via without a stop", "On a smooth path; otherwise the move stops at each"),
    ("jerk_bound", "jerk limits too", "Of the time-optimal profile"),
    ("average_torque", "average torque too", "Of the time-optimal profile"),
)

Edit = Callable[[str, str], None]
"""Takes a field's name and its new text."""


@dataclass(eq=False)
class Panels:
    """Handles of one tab's fields, buttons and views."""

    gui: viser.GuiApi
    edit: Edit
    fields: dict[str, Any] = field(default_factory=dict)
    buttons: dict[str, Any] = field(default_factory=dict)
    views: dict[str, Any] = field(default_factory=dict)
    folders: dict[str, Any] = field(default_factory=dict)
    _complaints: dict[str, Any] = field(default_factory=dict)
    _said: dict[str, str] = field(default_factory=dict)

    def show_fields(self, state: State, but: str = "") -> None:
        """Put the state's texts into the fields, except the one that is being edited."""
        for name, handle in self.fields.items():
            text = state.asked.get(name)
            if text is None or name == but:
                continue
            if isinstance(handle.value, bool):
                handle.value = bool(text)
            elif isinstance(handle.value, float):
                handle.value = float(text) if name not in state.complaints else handle.value
            else:
                handle.value = text

    def show_complaints(self, state: State) -> None:
        """Show each complaint below its field."""
        for name, handle in self._complaints.items():
            said = state.complaints.get(name, "")
            if said != self._said.get(name, ""):
                self._said[name] = said
                handle.content, handle.visible = complaint(name, said) if said else "", bool(said)

    def show(self, name: str, html: str) -> None:
        """Show the HTML of a view."""
        handle = self.views[name]
        if handle.content != html:
            handle.content = html

    def text(self, name: str, label: str, value: str, hint: str) -> None:
        """Add a field for a text or a number."""
        self._add(name, self.gui.add_text(label, value, hint=hint))

    def choice(self, name: str, label: str, options: tuple[str, ...], value: str, hint: str) -> None:
        """Add a field that has one of some words."""
        self._add(name, self.gui.add_dropdown(label, options, initial_value=value, hint=hint))

    def flag(self, name: str, label: str, hint: str) -> None:
        """Add a field that is on or off."""
        self._add(name, self.gui.add_checkbox(label, False, hint=hint))

    def slider(self, name: str, label: str, low: float, high: float, step: float, value: float) -> None:
        """Add a slider with its number."""
        self._add(name, self.gui.add_slider(label, low, high, step, value))

    def button(self, name: str, label: str, hint: str | None = None) -> None:
        """Add a button."""
        self.buttons[name] = self.gui.add_button(label, hint=hint)

    def group(self, name: str, label: str, options: tuple[str, ...], hint: str) -> None:
        """Add buttons side by side."""
        self.buttons[name] = self.gui.add_button_group(label, options, hint=hint)

    def place(self, *names: str) -> None:
        """Add places for views."""
        for name in names:
            self.views[name] = self.gui.add_html("")

    def _add(self, name: str, handle: Any) -> None:
        self.fields[name] = handle
        self.place_complaint(name)

        async def changed(event: Any) -> None:
            if event.client_id is None:  # the page itself has put the value there
                return
            value = event.target.value
            self.edit(
                name,
                ("yes" if value else "") if isinstance(value, bool) else repr(value) if isinstance(value, float) else value,
            )

        handle.on_update(changed)

    def place_complaint(self, name: str) -> None:
        """Add the place of a field's complaint."""
        self._complaints[name] = self.gui.add_html("", visible=False)


def build(gui: viser.GuiApi, state: State, edit: Edit, width: int) -> Panels:
    """Build the panels: what is set on the left, what follows on the right, or below it.

    Args:
        gui: of the tab.
        state: its first state.
        edit: takes a field's change.
        width: of the window [px].
    """
    gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False, control_width="large")
    panels = Panels(gui, edit)
    gui.main_panel.dock_left()
    gui.main_panel.set_width(_WIDTH)
    tabs = gui.add_tab_group()
    for title, fill in (("Pose", _pose), ("Target", _target), ("Move", _move), ("Drives", _drives)):
        with tabs.add_tab(title):
            fill(panels, state)
    results = gui.add_panel()
    with results.add_tab("Loads"):
        panels.place("bars", "figures", "arrows")
    with results.add_tab("Motion"):
        _motion(panels)
    if width < _NARROW:
        results.dock_below(gui.main_panel)
    else:
        results.dock_right()
        results.set_width(_WIDTH)
    return panels


def _pose(panels: Panels, state: State) -> None:
    limits = state.boom.limits
    for i, joint in enumerate(JOINTS):
        turn, step, unit = (1.0, 0.001, "m") if IS_LENGTH[i] else (180.0 / np.pi, 0.1, "deg")
        low, high = round(turn * float(limits.lower[i]), 9), round(turn * float(limits.upper[i]), 9)
        panels.slider(joint, f"{joint} [{unit}]", low, high, step, state.joints[i])
    panels.text("pose", "pose", state.asked["pose"], "A pose's name, or q=YAW,INNER,LOWER,EXTENSION,WRIST in deg and m")
    if state.boom.poses:
        panels.group("pose", "go to", tuple(state.boom.poses), "Move the boom to this pose")
    panels.text("payload", "payload [kg]", state.asked["payload"], "Mass at the tip")
    panels.text("roll", "roll [deg]", "0", "Tilt of the vehicle about its forward axis, left side up")
    panels.text("nose", "nose down [deg]", "0", "Tilt of the vehicle about its left axis")
    panels.choice("vehicle", "vehicle", (OWN, *named_cases()), OWN, "A case's track and shock act on a planned move alone")


def _target(panels: Panels, state: State) -> None:
    for axis in "xyz":
        panels.text(axis, f"tip {axis} [m]", state.asked[axis], "Position of the tip in the mount's frame")
    panels.text("pitch", "pitch", "down", "Elevation of the end effector: down, level, up, free, or degrees")
    panels.text("constraint", "constraint", "horizontal", f"{', '.join(WORDS)}, actuator=DEG or extension=M")
    panels.place("solving")
    panels.group("branch", "branch", ("before", "next"), "Step through the branches within the limits")
    panels.place_complaint("branch")
    panels.place("branches")
    panels.group("workspace", "workspace", ("show", "hide"), "Cells that the tip reaches under this pitch and constraint")
    panels.place("workspace", "mapping")


def _move(panels: Panels, state: State) -> None:
    panels.text("start", "start", state.asked["start"], "A pose's name, q=... or tip=X,Y,Z")
    panels.text("via", "via", "", "Targets on the way, with semicolons between them")
    panels.text("goal", "goal", state.asked["goal"], "A pose's name, q=... or tip=X,Y,Z")
    panels.group("take", "this pose is", ("start", "via", "goal"), "Take the pose that the sliders have")
    panels.choice("profile", "profile", tuple(map(str, PROFILES)), "cubic", "How the path is timed")
    panels.text("along", "along", "joint", "joint, line or arc=X,Y,Z")
    panels.text("duration", "duration [s]", "", "Nothing: the shortest that the limits allow")
    panels.text("rate", "rate [Hz]", "", "Rate of a controller, on whose clock samples and stops lie")
    for name, label, hint in _FLAGS:
        panels.flag(name, label, hint)
    panels.button("plan", "Plan")
    panels.group("work", "then", ("look for fixes", "stop"), "Single changes that make the move possible; stop slow work")
    panels.place("planning")
    panels.folders["fixes"] = panels.gui.add_folder("Possible fixes", visible=False)
    panels.place("command")
    for k in (0, 3):
        panels.group(f"save{k}", "save", SAVED[k : k + 3], "The browser saves the file")


def _drives(panels: Panels, state: State) -> None:
    panels.place("drives")
    for joint in JOINTS:
        name = drive_field(joint)
        panels.choice(name, joint, offered(state.catalogue, joint), state.asked[name], "Motor and gearbox of the catalogue")
    panels.place("unwritten")


def _motion(panels: Panels) -> None:
    panels.place("verdict")
    panels.folders["time"] = panels.gui.add_folder("Time", visible=False)
    with panels.folders["time"]:
        panels.button("play", "Play")
        panels.fields["time"] = panels.gui.add_slider("t [s]", 0.0, 1.0, 0.01, 0.0)
        panels.place("now", "planes")
    panels.folders["charts"] = panels.gui.add_folder("Over time", visible=False)
