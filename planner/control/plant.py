"""Plant model for controller design: rigid links, elastic gearboxes, bending links and friction.

A joint whose gearbox has a printed stiffness has two coordinates, theta of the motor (at the joint
side of the gears) and q of the link:

    M(q) qdd + h(q, qd) + friction(qd) = T_s + c (thetad - qd)
    J thetadd + F(thetad, T_s) + T_s + c (thetad - qd) = u         J = N^2 (J_rotor + J_gear)

At a joint without elasticity u takes the place of T_s + c (thetad - qd).

T_s(theta - q) is the torque of the gearbox, with piecewise stiffness K1, K2, K3, in series with a
torsional spring that represents the bending of the link. A force F at the end of a cantilever of
length L deflects it by F L^3 / (3 E I), which is the angle F L^2 / (3 E I) seen from its root.

- Pin 8 loads the inner link with a force only, so the link is a spring of 3 E I / L at joint 2.
- The length L_f = clear + theta4 of the extension is outside its housing. It lets the wrist deflect
  by F L_f^3 / (3 E I). At rho = L7 + theta4 from pin 8 this is a spring of 3 E I rho^2 / L_f^3 at
  joint 3.

Bending out of the arm's plane, torsion of the links and play of the pins are left out.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from boom_model import (
    JOINTS,
    BaseMotion,
    Boom,
    Drive,
    InfeasibleError,
    InputError,
    gravity_torque,
    mass_matrix,
)
from boom_model.arrays import Array, read_only
from boom_model.drives.drive import available_torque, reflected_inertia
from boom_model.dynamics.equations_of_motion import mass_matrix_and_bias
from planner.control.figures import Figures


@dataclass(frozen=True, eq=False)
class Plant:
    """Boom with the elasticity and friction of its drives. m joints are elastic."""

    boom: Boom
    figures: Figures
    elastic: tuple[int, ...]
    """Indices of the elastic joints."""
    rotor: Array
    """(5,) drive inertia N^2 (J_rotor + J_gear) at the joint [kg m^2]; 0 if it is not known."""
    stiffness: Array
    """(m, 3) stiffness K1, K2, K3 of the gearboxes [Nm/rad]."""
    breaks: Array
    """(m, 2) torques T1, T2 at which the stiffness changes [Nm]."""
    gap: Array
    """(m,) backlash [rad]; 0 unless it is included."""
    damping: Array
    """(m,) damping c [Nm s/rad]."""
    coulomb: Array
    """(m,) no-load torque N T_noload of the gearbox [Nm]."""
    loss: Array
    """(m,) 1 / eta - 1, additional friction while driving divided by the load."""
    bends: bool
    """Whether inner link and extension bend."""

    @staticmethod
    def of(
        boom: Boom,
        figures: Figures | None = None,
        *,
        elastic: bool = True,
        bending: bool = True,
        backlash: bool = False,
        reference: Array | None = None,
    ) -> "Plant":
        """Return the plant of a boom.

        Args:
            boom: the boom.
            figures: assumed figures; None takes every default.
            elastic: whether gearboxes with a printed stiffness twist. If not, the inertia of the
                drive is added to the joint.
            bending: whether inner link and extension bend, in series with the gearbox.
            backlash: whether the gearboxes have the backlash of their datasheets.
            reference: joint position (5,) at which the lowest mode has the structural damping
                ratio; None is the middle of the joint ranges. There c = 2 zeta K / omega_1
                (damping proportional to stiffness).

        Raises:
            InputError: the linkage has unequal links.
            InfeasibleError: as `natural_frequencies`.
        """
        boom.geometry.require_parallelogram("boom control")
        figures = Figures.of() if figures is None else figures
        joints = [i for i, drive in enumerate(boom.drives) if elastic and drive is not None and _is_elastic(drive)]
        gears = [drive.gearbox for i in joints if (drive := boom.drives[i])]
        share, count = figures.friction_share, len(joints)
        plant = Plant(
            boom=boom,
            figures=figures,
            elastic=tuple(joints),
            rotor=boom.drive_inertia,
            stiffness=read_only(np.reshape([g.torsion_stiffness for g in gears], (count, 3))),
            breaks=read_only(np.reshape([g.torsion_torques for g in gears], (count, 2))),
            gap=read_only([(g.backlash or 0.0) if backlash else 0.0 for g in gears]),
            damping=read_only(np.zeros(count)),
            coulomb=read_only([share * g.ratio * (g.no_load_input_torque or 0.0) for g in gears]),
            loss=read_only([share * (1.0 / (g.efficiency or 1.0) - 1.0) for g in gears]),
            bends=bending,
        )
        if not joints:
            return plant
        q = (boom.limits.lower + boom.limits.upper) / 2.0 if reference is None else np.asarray(reference, dtype=float)
        damping = (
            2.0 * figures.structural_damping / (2.0 * np.pi * natural_frequencies(plant, q)[0]) * tangent_at_rest(plant, q)
        )
        return replace(plant, damping=read_only(damping))

    def with_boom(self, boom: Boom) -> "Plant":
        """Return the plant with another boom, for example one with another payload."""
        return replace(self, boom=boom)

    @cached_property
    def columns(self) -> slice | list[int]:
        """Columns of the elastic joints, as `quick_index`."""
        return quick_index(self.elastic)

    @cached_property
    def elastic_rotor(self) -> Array:
        """(m,) N^2 (J_rotor + J_gear) of the elastic joints [kg m^2]."""
        return read_only(self.rotor[list(self.elastic)])

    @cached_property
    def softness(self) -> Array:
        """(3, m) 1 / K1, 1 / K2, 1 / K3 of the gearboxes [rad/Nm]."""
        return read_only(1.0 / self.stiffness.T)

    @cached_property
    def spans(self) -> Array:
        """(2, m) T1 and T2 - T1, the torques over the first two segments of a gearbox [Nm]."""
        return read_only([self.breaks[:, 0], self.breaks[:, 1] - self.breaks[:, 0]])

    @cached_property
    def half_gap(self) -> Array:
        """(m,) half of the backlash [rad]."""
        return read_only(0.5 * self.gap)

    @cached_property
    def stick(self) -> float:
        """Speed that scales Coulomb friction [rad/s]."""
        return float(np.radians(self.figures.stick_deg_s))

    @cached_property
    def rigid_inertia(self) -> Array:
        """(5, 5) inertia of the drives at joints without elasticity [kg m^2]."""
        stiff = self.rotor.copy()
        stiff[list(self.elastic)] = 0.0
        return read_only(np.diag(stiff))

    @cached_property
    def has_joint_friction(self) -> bool:
        """Whether the joints have friction besides that of their drives."""
        return bool(self.boom.friction.viscous.any() or self.boom.friction.coulomb.any())

    @property
    def limits(self) -> tuple[str, ...]:
        """Limitations of this plant, a sentence each."""
        driven = [JOINTS[i] for i, drive in enumerate(self.boom.drives) if drive is not None]
        without = [joint for joint in JOINTS if joint not in driven]
        sentences = []
        if without:
            sentences.append(
                f"{', '.join(without)}: no drive is given; simulated with unlimited torque and without inertia, elasticity and "
                "friction of a drive, so the drive limits are NOT CHECKABLE"
            )
        rigid = [joint for joint in driven if JOINTS.index(joint) not in self.elastic]
        if rigid:
            sentences.append(f"{', '.join(rigid)}: the gearbox is simulated as rigid and without friction")
        return tuple(sentences)


def quick_index(indices: Sequence[int]) -> slice | list[int]:
    """Return evenly spaced indices as a slice, which NumPy indexes faster, others as given."""
    if not indices:
        return slice(0)
    step = indices[1] - indices[0] if len(indices) > 1 else 1
    evenly = range(indices[0], indices[-1] + 1, step)
    return slice(evenly.start, evenly.stop, step) if list(evenly) == list(indices) else list(indices)


def _is_elastic(drive: Drive) -> bool:
    """Return whether the datasheets give all figures of an elastic joint."""
    gear = drive.gearbox
    return None not in (gear.torsion_stiffness, gear.torsion_torques, reflected_inertia(drive))


def compliance(plant: Plant, q: Array) -> tuple[Array, Array]:
    """Return the bending compliance C (..., m) [rad/Nm] behind each elastic joint, and dC/dtheta4.

    The derivative is in rad/(Nm m).
    """
    C, C_4 = np.zeros((*q.shape[:-1], len(plant.elastic))), np.zeros((*q.shape[:-1], len(plant.elastic)))
    if plant.bends:
        for column, joint in enumerate(plant.elastic):
            if joint == 1:
                C[..., column] = plant.boom.geometry.L9 / (3.0 * plant.figures.inner_bending)
            elif joint == 2:
                free = np.maximum(plant.figures.extension_clear_mm * 1e-3 + q[..., 3], 0.0)
                share = free / (plant.boom.geometry.L7 + q[..., 3])
                bent = share * share / (3.0 * plant.figures.extension_bending)
                C[..., column] = bent * free
                C_4[..., column] = bent * (3.0 - 2.0 * share)
    return C, C_4


def _segments(plant: Plant, C: Array) -> tuple[tuple[Array, Array, Array], Array, Array]:
    """Return the stiffnesses in series with compliance C (..., m), and the twists between them."""
    first, second, third = (1.0 / (softness + C) for softness in plant.softness)
    end_1 = plant.breaks[:, 0] / first
    return (first, second, third), end_1, end_1 + (plant.breaks[:, 1] - plant.breaks[:, 0]) / second


def spring_torque(plant: Plant, q: Array, twist: Array, C: Array | None = None) -> Array:
    """Compute T_s (..., m) [Nm] at a twist theta - q (..., m) [rad]."""
    C = compliance(plant, q)[0] if C is None else C
    soft_1, soft_2, soft_3 = (softness + C for softness in plant.softness)
    span_1, span_2 = plant.spans
    on_1 = np.maximum(np.abs(twist) - plant.half_gap, 0.0)
    on_2 = on_1 - span_1 * soft_1
    on_3 = on_2 - span_2 * soft_2
    size = np.minimum(on_1 / soft_1, span_1)
    size += np.minimum(np.maximum(on_2, 0.0) / soft_2, span_2)
    size += np.maximum(on_3, 0.0) / soft_3
    torque: Array = np.copysign(size, twist)
    return torque


def twist_under(plant: Plant, q: Array, torque: Array) -> Array:
    """Compute the twist (..., m) [rad] at a torque (..., m) [Nm], inverting `spring_torque`."""
    C, size = compliance(plant, q)[0], np.abs(torque)
    (k1, k2, k3), _, _ = _segments(plant, C)
    low, high = plant.breaks[:, 0], plant.breaks[:, 1]
    x = np.minimum(size, low) / k1 + np.clip(size - low, 0.0, high - low) / k2 + np.maximum(size - high, 0.0) / k3
    twist: Array = np.copysign(x + 0.5 * plant.gap * (size > 0.0), torque)
    return twist


def spring_energy(plant: Plant, q: Array, twist: Array) -> Array:
    """Compute the energy (...) [J] of all springs, the integral of T_s over the twist."""
    (k1, k2, k3), end_1, end_2 = _segments(plant, compliance(plant, q)[0])
    x = np.maximum(np.abs(twist) - 0.5 * plant.gap, 0.0)
    a, b, c = np.minimum(x, end_1), np.clip(x - end_1, 0.0, end_2 - end_1), np.maximum(x - end_2, 0.0)
    low, high = plant.breaks[:, 0], plant.breaks[:, 1]
    energy: Array = (0.5 * (k1 * a**2 + k2 * b**2 + k3 * c**2) + low * b + high * c).sum(axis=-1)
    return energy


def tangent_stiffness(plant: Plant, q: Array, torque: Array) -> Array:
    """Compute dT_s/d(twist) (..., m) [Nm/rad] at a torque (..., m) [Nm]."""
    (k1, k2, k3), _, _ = _segments(plant, compliance(plant, q)[0])
    size = np.abs(torque)
    stiffness: Array = np.where(size < plant.breaks[:, 0], k1, np.where(size < plant.breaks[:, 1], k2, k3))
    return stiffness


def tangent_at_rest(plant: Plant, q: Array) -> Array:
    """Compute `tangent_stiffness` (..., m) at the gravity torque."""
    return tangent_stiffness(plant, q, gravity_torque(plant.boom, q)[..., list(plant.elastic)])


def natural_frequencies(plant: Plant, q: Array, stiffness: Array | None = None) -> Array:
    """Compute the natural frequencies (m,) [Hz], lowest first, with motors and rigid joints fixed.

    det(K + dg/dq - omega^2 M) = 0 for the elastic joints.

    Args:
        plant: the plant.
        q: joint position (5,).
        stiffness: K (m,) [Nm/rad]; None is the tangent stiffness at the gravity torque.

    Raises:
        InputError: no joint is elastic.
        InfeasibleError: the elastic joints are too soft to carry the weight of the boom.
    """
    if not plant.elastic:
        raise InputError("no joint is elastic, so there are no natural frequencies")
    E = list(plant.elastic)
    K = np.diag(tangent_at_rest(plant, q) if stiffness is None else stiffness) + gravity_stiffness(plant.boom, q)[np.ix_(E, E)]
    squares = np.linalg.eigvals(np.linalg.solve(mass_matrix(plant.boom, q)[np.ix_(E, E)], K))
    if not squares.real.min() > 0.0:
        raise InfeasibleError("the boom is unstable under its weight with the motors fixed: gearboxes or links are too soft")
    frequencies: Array = np.sqrt(np.sort(squares.real)) / (2.0 * np.pi)
    return frequencies


def gravity_stiffness(boom: Boom, q: Array) -> Array:
    """Compute dg/dq (5, 5). The relative error is some 1e-12, because g is a sum of sines."""
    return jacobian(lambda x: gravity_torque(boom, x), q)


def jacobian(f: Callable[[Array], Array], x: Array, h: float = 1e-2) -> Array:
    """Compute df/dx (k, n) of f: (..., n) -> (..., k) at x (n,), with step h.

    A central difference of sixth order, in one call of f.
    """
    weights = np.array([3.0 / 4.0, -3.0 / 20.0, 1.0 / 60.0]) / h
    shifts = h * np.arange(1.0, 4.0)[:, None, None] * np.eye(x.size)
    values = f(np.stack([x + shifts, x - shifts]))
    slope: Array = np.einsum("s,sik->ki", weights, values[0] - values[1])
    return slope


def friction(plant: Plant, speed: Array, load: Array) -> Array:
    """Compute the friction F (..., m) [Nm] of the gearboxes.

        F = tanh(speed / v) (N T_noload + (1 / eta - 1) max(T_s sign(speed), 0))

    While driving this is the friction of `motor_torque`. While braking only the no-load torque
    helps to brake. tanh replaces the sign, so friction does not stick but creeps below v.

    Args:
        plant: the plant.
        speed: motor speed (..., m) at the joint [rad/s].
        load: T_s (..., m) [Nm].
    """
    direction = np.tanh(speed / plant.stick)
    torque: Array = direction * (plant.coulomb + plant.loss * np.maximum(load * np.sign(speed), 0.0))
    return torque


def accelerations(
    plant: Plant,
    q: Array,
    qd: Array,
    theta: Array,
    theta_d: Array,
    u: Array,
    *,
    base: BaseMotion | None = None,
    tip_force: Array | None = None,
) -> tuple[Array, Array]:
    """Compute qdd (B, 5) and thetadd (B, m) of B states of the plant.

    Args:
        plant: the plant.
        q: joint position (B, 5).
        qd: joint velocity (B, 5).
        theta: motor position (B, m) at the joint side of the gears.
        theta_d: motor velocity (B, m) at the joint side of the gears.
        u: drive torque (B, 5) [Nm] at the joint side of the gears.
        base: motion of the vehicle, each entry (3,); None is at rest on level ground.
        tip_force: external force (3,) or (B, 3) on the tip [N].

    Raises:
        InputError: a state is not finite.
    """
    boom, E = plant.boom, plant.columns
    tau: Array = u.copy()
    thetadd = np.zeros_like(theta)
    if plant.elastic:
        C, C_4 = compliance(plant, q)
        load = spring_torque(plant, q, theta - q[:, E], C)
        passed = load + plant.damping * (theta_d - qd[:, E])
        tau[:, E] = passed
        # A bent extension pushes outwards; this conserves the energy.
        tau[:, 3] += 0.5 * np.vecdot(load * load, C_4)
        thetadd = (u[:, E] - passed - friction(plant, theta_d, load)) / plant.elastic_rotor
    if plant.has_joint_friction:
        direction = np.tanh(qd / plant.stick)
        tau -= boom.friction.viscous * qd + boom.friction.dry(direction)
    M, bias = mass_matrix_and_bias(boom, q, qd, base=base, tip_force=tip_force)
    qdd = np.linalg.solve(M + plant.rigid_inertia, (tau - bias)[..., None])[..., 0]
    return np.asarray(qdd), thetadd


def equilibrium(plant: Plant, theta: Array, base: BaseMotion | None = None) -> Array:
    """Solve q = theta - twist(g(q)) for the static joint position q (B, 5), theta (B, 5)."""
    q, E = theta.copy(), list(plant.elastic)
    if E:
        for _ in range(20):  # fixed-point iteration; each step reduces the error by g' / K, some 1e-3
            q[:, E] = theta[:, E] - twist_under(plant, q, gravity_torque(plant.boom, q, base=base)[:, E])
    return q


def torque_limits(plant: Plant, speed: Array) -> Array:
    """Compute N T_available(N speed) (..., 5) [Nm]; infinite where it is not known.

    `speed` (..., 5) [rad/s] is the motor speed at the joint.
    """
    limits = np.full(speed.shape, np.inf)
    for i, drive in enumerate(plant.boom.drives):
        if drive is None:
            continue
        available = available_torque(drive, drive.gearbox.ratio * speed[..., i])
        running = drive.motor.running_torque
        if available is not None:
            limits[..., i] = drive.gearbox.ratio * available
        elif running is not None:
            limits[..., i] = drive.gearbox.ratio * running
    return limits
