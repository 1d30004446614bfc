"""One tab of the page: events change its state, and the views that differ are sent."""

import asyncio
import sys
import traceback
from collections.abc import Callable, Coroutine
from dataclasses import replace
from functools import partial
from html import escape
from typing import Any

import numpy as np
import viser
from viser import uplot

from boom_model import BoomError
from boom_model.kinematics.constraints import parse_constraint
from planner.page import downloads
from planner.page import state as states
from planner.page.drawing import Drawing
from planner.page.html import bars_html, block, css, figures_html
from planner.page.jobs import Worker
from planner.page.motion_view import Chart, charts, now_view, planes_view, verdict_view
from planner.page.panels import Panels, build
from planner.page.plans import make_plan, spec_of, text_of
from planner.page.pose_view import pose_view
from planner.page.state import State
from planner.page.target_view import branches_html, workspace_html
from planner.page.workspace import workspace
from planner.paths.targets import parse_pitch
from planner.progress import Track
from planner.suggestions import Suggestion, suggestions

_EYE, _LOOK_AT, _VIEW_ANGLE = (2.6, -4.4, 2.0), (0.3, 0.8, 0.3), 0.75  # [m], [m], [rad]
_FRAME = 1.0 / 25.0  # [s] between two pictures while a motion plays


class Session:
    """State of one tab and the handles that show it. All of its methods run on the event loop."""

    def __init__(self, client: viser.ClientHandle, first: State) -> None:
        """Build the tab of a client, and show its first state."""
        self.state = first
        self._client = client
        self._panels = build(client.gui, first, self.edit, client.camera.image_width)
        self._drawing = Drawing(client.scene, first.boom)
        self._solver, self._worker = Worker(partial(self._busy, "solving")), Worker(partial(self._busy, "planning"))
        self._closed = False
        self._playing: asyncio.Task[None] | None = None
        self._tasks: set[asyncio.Task[None]] = set()
        self._extras: list[Any] = []
        self._fixes: list[Any] = []
        self._connect()
        with client.atomic():
            self._show(first, None)
        client.camera.position, client.camera.look_at, client.camera.fov = _EYE, _LOOK_AT, _VIEW_ANGLE

    def close(self) -> None:
        """End the work of a tab that was closed."""
        self._closed = True
        self._solver.stop()
        self._worker.stop()
        self._halt()

    def edit(self, name: str, text: str) -> None:
        """Change a field."""
        before = self.state
        self.apply(partial(states.edited, name=name, text=text), but=name)
        if name in states.TARGET and self.state.target != before.target:
            self._solve()
        if name.startswith("drive_") and before.planned is not None and self.state.boom is not before.boom:
            self.plan()

    def apply(self, change: Callable[[State], State], but: str = "") -> None:
        """Change the state, and show what differs, or a program error in the page and on stderr."""
        if self._closed:
            return
        before = self.state
        try:
            self.state = change(before)
            with self._client.atomic():
                self._show(self.state, before, but)
        except Exception as error:
            self.state = before
            traceback.print_exception(error, file=sys.stderr)
            self._client.add_notification("Internal error", f"{type(error).__name__}: {error}", color="red")
        self._client.flush()

    def plan(self) -> None:
        """Plan the move that the fields describe."""
        now = self.state
        self._start(
            self._worker.run(
                "planning",
                lambda _: make_plan(now.boom, now.move, now.slope),
                lambda planned: self.apply(lambda state: states.with_plan(state, planned)),
                lambda reason: self.apply(lambda state: states.with_failure(state, reason)),
            )
        )

    def _solve(self) -> None:
        now = self.state
        if now.target.is_quick:
            self._solver.stop()
            self.apply(lambda state: states.with_branches(state, states.solve(now.boom, now.target, now.q)))
            return
        self._start(
            self._solver.run(
                "looking for branches",
                lambda _: states.solve(now.boom, now.target, now.q),
                lambda branches: self.apply(lambda state: states.with_branches(state, branches)),
                lambda reason: self.apply(lambda state: replace(state, complaints={**state.complaints, "x": reason})),
            )
        )

    def _look_for_fixes(self) -> None:
        now = self.state

        def work(track: Track) -> tuple[Suggestion, ...]:
            return suggestions(now.boom, spec_of(now.move, now.slope), track)

        self._start(self._worker.run("looking for possible fixes", work, self._take_fixes, self._complain))

    def _take_fixes(self, found: tuple[Suggestion, ...]) -> None:
        if not found:
            self._complain("no single change helps, or nothing is wrong")
        self.apply(lambda state: replace(state, suggestions=found))

    def _map(self) -> None:
        now = self.state
        pitch, constraint = parse_pitch(now.target.pitch), parse_constraint(now.target.constraint)
        if pitch is None:
            self._complain("pitch free: the workspace is drawn for one pitch")
            return
        self._start(
            self._worker.run(
                "mapping the workspace",
                lambda track: workspace(now.boom, constraint, pitch, track),
                lambda layer: self.apply(lambda state: replace(state, workspace=layer)),
                self._complain,
            )
        )

    def _save(self, kind: str) -> None:
        now = self.state
        name = downloads.files_of(now).get(kind)
        if name is None:
            self._complain("plan a move first" if now.planned is None else "nothing to save: the command needs no such file")
            return
        self._start(
            self._worker.run(
                f"writing {name}",
                lambda _: downloads.content(now, kind),
                lambda data: self._client.send_file_download(name, data, save_immediately=True),
                self._complain,
            )
        )

    def _take(self, name: str) -> None:
        word = states.pose_word(self.state)
        if name == "via" and self.state.asked["via"].strip():
            word = f"{self.state.asked['via']}; {word}"
        self.apply(lambda state: states.edited(state, name, word))

    def _play(self) -> None:
        if self._playing is not None:
            self._halt()
        elif self.state.planned is not None:
            self._panels.buttons["play"].label = "Pause"
            self._playing = asyncio.get_running_loop().create_task(self._run_motion())

    async def _run_motion(self) -> None:
        loop, planned = asyncio.get_running_loop(), self.state.planned
        at = self.state.time or 0.0
        begun = loop.time() - (0.0 if planned is None or at >= planned.duration else at)
        while planned is not None and self.state.planned is planned:
            time = loop.time() - begun
            self.apply(partial(states.at_time, time=time))
            if time >= planned.duration:
                break
            await asyncio.sleep(_FRAME)
        self._playing = None
        self._panels.buttons["play"].label = "Play"

    def _halt(self) -> None:
        if self._playing is not None:
            self._playing.cancel()
            self._playing = None
        if not self._closed:
            self._panels.buttons["play"].label = "Play"

    def _start(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def _busy(self, place: str, title: str, share: float | None) -> None:
        if self._closed:
            return
        self._panels.show(place, "" if share is None else block(f'<div role="status">{title}: {share:.0%}</div>'))
        self._client.flush()

    def _complain(self, text: str) -> None:
        self._client.add_notification("Not done", text, color="orange", auto_close_seconds=10.0)
        self._client.flush()

    # What is shown

    def _show(self, now: State, old: State | None, but: str = "") -> None:
        """Show a state; what `old` has in common with it is shown already."""
        panels, drawing = self._panels, self._drawing
        if old is None or now.asked is not old.asked:
            panels.show_fields(now, but)
        panels.show_complaints(now)
        payload = old is None or now.boom.payload is not old.boom.payload
        if old is not None and payload:
            drawing.show_payload(now.boom)
        if old is None or now.slope != old.slope:
            drawing.show_slope(now.slope)
        if old is None or now.boom is not old.boom or now.slope != old.slope or not np.array_equal(now.shown_q, old.shown_q):
            self._show_pose(now)
        if old is None or now.branches is not old.branches:
            panels.show("branches", branches_html(now.branches))
        if old is not None and now.workspace is not old.workspace:
            panels.show("workspace", workspace_html(now.workspace))
            drawing.show_workspace(now.workspace)
        if old is None or (now.move, now.boom, now.slope, now.swapped) != (old.move, old.boom, old.slope, old.swapped):
            panels.show("command", _command(now))
        if old is None or now.unwritten != old.unwritten:
            panels.show("unwritten", block("".join(f"<div>Only on this page: {escape(each)}</div>" for each in now.unwritten)))
        self._show_motion(now, old)
        if old is not None and now.suggestions is not old.suggestions:
            self._show_fixes(now.suggestions)

    def _show_pose(self, now: State) -> None:
        view = pose_view(now.boom, now.shown_q, now.slope)
        self._drawing.show_pose(view, float(now.shown_q[0]))
        x, y, z = view.tip
        self._drawing.show_target((float(x), float(y), float(z)))
        self._panels.show("bars", block(f"<b>Static torque, of what the drive allows</b>{bars_html(view.bars)}"))
        self._panels.show("figures", block(figures_html(view.figures)))
        self._panels.show("arrows", block(f'<div id="scale">{view.scale.sentence}; light: forces, purple: moment</div>'))

    def _show_motion(self, now: State, old: State | None) -> None:
        panels, planned = self._panels, now.planned
        if old is None or planned is not old.planned or now.failure != old.failure:
            why = f"not possible: {escape(now.failure)}" if now.failure else "Plan a move under Move."
            said = f'<div id="verdict" role="alert">{why}</div>'
            panels.show("verdict", block(said) if planned is None else verdict_view(planned))
        if old is not None and planned is not old.planned:
            self._halt_other(planned)
            self._drawing.show_path(planned)
            panels.folders["time"].visible = panels.folders["charts"].visible = planned is not None
            self._show_charts(() if planned is None else charts(planned))
            if planned is not None:
                panels.fields["time"].max = max(planned.duration, 0.01)
        if planned is not None and now.time is not None and (old is None or now.time != old.time or planned is not old.planned):
            panels.fields["time"].value = now.time
            panels.show("now", now_view(planned, now.time))
            panels.show("planes", planes_view(planned, now.time))

    def _halt_other(self, planned: Any) -> None:
        if planned is None:
            self._halt()

    def _show_charts(self, drawn: tuple[Chart, ...]) -> None:
        for handle in self._extras:
            handle.remove()
        with self._panels.folders["charts"]:
            self._extras = [_add_chart(self._panels, chart) for chart in drawn]

    def _show_fixes(self, found: tuple[Suggestion, ...]) -> None:
        for handle in self._fixes:
            handle.remove()
        self._fixes, folder = [], self._panels.folders["fixes"]
        folder.visible = bool(found)
        with folder:
            for k, each in enumerate(found, start=1):
                said = self._client.gui.add_html(block(f"{k}. {escape(each.sentence)}"))
                button = self._client.gui.add_button(f"Apply fix {k}", hint="Apply it, and plan again")
                button.on_click(self._applies(each))
                self._fixes += [said, button]

    def _applies(self, suggestion: Suggestion) -> Callable[[Any], Coroutine[Any, Any, None]]:
        async def take(_: Any) -> None:
            self.apply(lambda state: states.with_suggestion(state, suggestion))
            self.plan()

        return take

    # What the user does

    def _connect(self) -> None:
        """Connect buttons, the time's slider and the gizmo with what they do."""
        actions: dict[str, Callable[[str], None]] = {
            "plan": lambda _: self.plan(),
            "play": lambda _: self._play(),
            "pose": lambda name: self.apply(partial(states.edited, name="pose", text=name)),
            "branch": lambda way: self.apply(partial(states.next_branch, step=1 if way == "next" else -1)),
            "workspace": lambda way: self._map() if way == "show" else self.apply(_without_workspace),
            "take": self._take,
            "work": lambda what: self._stop_work() if what == "stop" else self._look_for_fixes(),
            "save0": self._save,
            "save3": self._save,
        }
        for name, handle in self._panels.buttons.items():
            handle.on_click(_calling(actions[name]))

        async def moved(event: Any) -> None:
            if event.client_id is not None:
                self._halt()
                self.apply(lambda state: states.at_time(state, event.target.value))

        self._panels.fields["time"].on_update(moved)

        async def dragged(event: Any) -> None:
            self._drag(event.target.position, event.phase)

        self._drawing.gizmo.on_update(dragged)

    def _stop_work(self) -> None:
        self._solver.stop()
        self._worker.stop()
        self._halt()

    def _drag(self, position: Any, phase: str) -> None:
        if phase == "update" and (self.state.target.is_quick or not self._solver.is_busy):
            x, y, z = (round(float(value), 4) + 0.0 for value in position)
            asked = {"x": text_of(x), "y": text_of(y), "z": text_of(z)}

            def change(state: State) -> State:
                state = replace(state, asked={**state.asked, **asked}, complaints={})
                return states.edited(state, "z", asked["z"])

            before = self.state.target
            self.apply(change)
            if self.state.target != before:
                self._solve()
        elif phase == "end":
            view = pose_view(self.state.boom, self.state.shown_q, self.state.slope)
            self._drawing.show_target((float(view.tip[0]), float(view.tip[1]), float(view.tip[2])))
            self._client.flush()


def _without_workspace(state: State) -> State:
    return replace(state, workspace=None)


def _calling(action: Callable[[str], None]) -> Callable[[Any], Coroutine[Any, Any, None]]:
    """Return what calls an action with the word of the button that was pressed."""

    async def call(event: Any) -> None:
        action(str(event.target.value))

    return call


def _command(state: State) -> str:
    try:
        text = downloads.command(state)
    except BoomError as error:
        text = str(error)
    beside = [name for kind, name in downloads.files_of(state).items() if kind in ("boom", "vehicle")]
    needs = f"<div>It needs, saved beside it: {escape(', '.join(beside))}</div>" if beside else ""
    look = "user-select:all;white-space:pre-wrap;overflow-wrap:anywhere"
    return block(f'<div>The same from a shell:</div><code id="command" style="{look}">{escape(text)}</code>{needs}')


def _add_chart(panels: Panels, chart: Chart) -> Any:
    lines = [uplot.Series(label="t")]
    for line in chart.lines:
        dash = (6.0, 4.0) if line.dashed else ()
        lines.append(uplot.Series(label=line.label, stroke=css(line.color), width=1.5, dash=dash))
    axis = uplot.Axis(stroke="#bbb", grid={"stroke": "rgba(160,160,160,.25)"})
    return panels.gui.add_uplot(
        (chart.t, *(line.values for line in chart.lines)),
        tuple(lines),
        title=chart.title,
        scales={"x": uplot.Scale(time=False)},
        axes=(axis, axis),
        height=260,
    )
