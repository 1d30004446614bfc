"""The boom in 3D, as a recording draws it, with workspace and the gizmo of the target."""

from typing import Any

import numpy as np
import viser
from scipy.spatial.transform import Rotation

from boom_model import Boom, forward_kinematics
from boom_model.arrays import Array
from planner.motion.vehicle import base_pose
from planner.page.plans import Planned
from planner.page.pose_view import PoseView
from planner.page.target_view import margin_span
from planner.page.vehicle import Slope
from planner.page.workspace import Workspace
from planner.recording.palette import COLORS, LIGHT, PAYLOAD_COLOR, PIN_COLOR, PURPLE
from planner.recording.solids import PIN_LENGTH, PIN_RADIUS, bars, corners, payload_radius, pins
from planner.recording.torque_ratio import BANDS, UNKNOWN, torque_ratios, worst_ratio
from planner.reports.reach_picture import margin_colors

_MOUNT, _BOOM, _PLANE = "/mount", "/mount/boom", "/mount/plane"
_GROUND = -1.0  # [m]
_PATH_POINTS = 400


class Drawing:
    """Scene of one tab. Each method shows one part of the state."""

    def __init__(self, scene: viser.SceneApi, boom: Boom) -> None:
        """Draw the solids of a boom, and what does not change."""
        self._scene = scene
        scene.set_up_direction("+z")
        scene.add_grid("/ground", 8.0, 8.0, plane="xy", position=(0.0, 0.0, _GROUND), cell_color=(90, 90, 90))
        self._mount = scene.add_frame(_MOUNT, axes_length=0.2, axes_radius=0.006, origin_radius=0.01)
        scene.add_box(f"{_MOUNT}/plate", PIN_COLOR, (0.4, 0.4, 0.02), position=(0.0, 0.0, -0.01))
        self._bodies = {name: scene.add_frame(f"{_BOOM}/{name}", show_axes=False) for name in (*COLORS, "tip")}
        for name, parts in bars(boom).items():
            for k, (low, high) in enumerate(zip(*corners(name, parts), strict=True)):
                size, middle = np.abs(high - low), (low + high) / 2.0
                scene.add_box(f"{_BOOM}/{name}/{k}", COLORS[name], tuple(size), position=middle)
        for name, centers in pins(boom).items():
            for k, center in enumerate(centers):
                scene.add_cylinder(f"{_BOOM}/{name}/pin{k}", PIN_RADIUS, PIN_LENGTH, PIN_COLOR, position=center)
        self._plane = scene.add_frame(_PLANE, show_axes=False)
        self._arrows: viser.ArrowsHandle | None = None
        self.gizmo = scene.add_transform_controls(
            f"{_MOUNT}/target", scale=0.25, disable_rotations=True, depth_test=False, line_width=3.0
        )
        self.show_payload(boom)

    def show_payload(self, boom: Boom) -> None:
        """Show the payload as a ball of steel."""
        radius = max(payload_radius(boom), 1e-3)
        self._scene.add_icosphere(f"{_BOOM}/tip/payload", radius, PAYLOAD_COLOR, visible=boom.payload.mass > 0.0)

    def show_slope(self, slope: Slope) -> None:
        """Tilt the mount with all that it carries."""
        self._mount.wxyz = _wxyz(base_pose(slope.case, np.zeros(1))[0, :3, :3])

    def show_pose(self, view: PoseView, yaw: float) -> None:
        """Show the bodies and the arrows of a joint position."""
        T = np.stack([view.bodies[name] for name in self._bodies])
        for handle, position, wxyz in zip(self._bodies.values(), T[:, :3, 3], _wxyz(T[:, :3, :3]), strict=True):
            handle.position, handle.wxyz = position, wxyz
        self._plane.wxyz = np.array([np.cos(yaw / 2.0), 0.0, 0.0, np.sin(yaw / 2.0)])
        points = np.array([[foot, foot + vector] for _, foot, vector in view.arrows])
        if self._arrows is None or len(self._arrows.points) != len(points):
            colors = np.array([PURPLE if "moment" in name else LIGHT for name, _, _ in view.arrows])
            self._arrows = self._scene.add_arrows(
                f"{_MOUNT}/loads", points, colors, shaft_radius=0.008, head_radius=0.02, head_length=0.05
            )
        else:
            self._arrows.points = points.astype(np.float32)

    def show_target(self, position: tuple[float, float, float]) -> None:
        """Put the gizmo at a tip target."""
        self.gizmo.position = np.array(position)

    def show_path(self, planned: Planned | None) -> None:
        """Show the tip's path of a planned move, coloured by the share of a drive's limit."""
        self._remove(f"{_MOUNT}/path")
        if planned is None or len(planned.move.trajectory.t) < 2:
            return
        move = planned.move
        count = len(move.trajectory.t)
        some = np.unique(np.linspace(0, count - 1, min(count, _PATH_POINTS)).astype(int))
        tip = forward_kinematics(move.boom, move.trajectory.q[some]).position
        worst = worst_ratio(torque_ratios(move.boom, move.trajectory, move.loads.tau))
        segments = np.stack([tip[:-1], tip[1:]], axis=1)
        if worst is None:
            colors = np.full((len(segments), 3), UNKNOWN[1])
        else:
            larger = np.maximum.reduceat(worst, some[:-1])
            larger = np.maximum(larger, worst[some[1:]])
            band = np.searchsorted([bound for bound, _, _ in BANDS], larger)
            colors = np.array([BANDS[b][2] for b in band])
        self._scene.add_line_segments(f"{_MOUNT}/path", segments, np.repeat(colors[:, None], 2, axis=1), thickness=0.012)

    def show_workspace(self, layer: Workspace | None) -> None:
        """Show the cells that the tip reaches, in the plane of the arm."""
        self._remove(f"{_PLANE}/workspace")
        if layer is None or not len(layer.points):
            return
        colors: Array = margin_colors(layer.margin, margin_span(layer))
        self._scene.add_point_cloud(
            f"{_PLANE}/workspace", layer.points, colors.astype(np.uint8), point_size=0.45 * layer.cell, point_shape="circle"
        )

    def _remove(self, name: str) -> None:
        self._scene.remove_by_name(name)


def _wxyz(R: Array) -> Any:
    """Return the quaternions (..., 4) of rotations (..., 3, 3), the real part first."""
    return np.roll(Rotation.from_matrix(R).as_quat(), 1, axis=-1)
