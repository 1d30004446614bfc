"""The boom as URDF and MJCF in Drake: joints, limits, actuators, masses, gravity torques, and the
loop that Drake closes.

Drake installs on fewer machines than this project, so its file is not collected with the suite:
`.ci/run` installs Drake where that is possible, runs this file by its name, and says so where it is
not.
"""

from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
import pytest
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import DiscreteContactApproximation, MultibodyPlant
from pydrake.systems.analysis import Simulator

from boom_model import JOINTS, Boom, forward_kinematics, gravity_torque
from boom_model.arrays import Array
from planner.exports.robot_models import write_model
from tests.oracles import random_states

BOOM = Boom.load()
FORMS = ("boom.urdf", "boom.xml")


class Loaded(NamedTuple):
    plant: MultibodyPlant
    G: Array
    """(nv, 5): the tree's coordinates are G q."""


@pytest.fixture(scope="module", params=FORMS)
def loaded(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Loaded:
    file = tmp_path_factory.mktemp("drake") / request.param
    write_model(BOOM, file)
    plant = MultibodyPlant(1e-3)
    plant.set_discrete_contact_approximation(DiscreteContactApproximation.kSap)  # the one that has constraints
    Parser(plant).AddModels(str(file))
    if file.suffix == ".urdf":
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("mount"))
    plant.Finalize()
    rows = mimicking(file) if file.suffix == ".urdf" else {"outer": [0, 1, -1, 0, 0], "upper": [0, -1, 1, 0, 0]}
    G = np.zeros((plant.num_velocities(), 5))
    for name, row in {**dict(zip(JOINTS, np.eye(5), strict=True)), **rows}.items():
        G[plant.GetJointByName(name).velocity_start()] = row
    return Loaded(plant, G)


def mimicking(file: Path) -> dict[str, Array]:
    """Each mimic joint's row of G."""
    rows = {}
    for joint in ElementTree.parse(file).iter("joint"):
        mimic = joint.find("mimic")
        if mimic is not None:
            rows[joint.attrib["name"]] = float(mimic.attrib["multiplier"]) * np.eye(5)[JOINTS.index(mimic.attrib["joint"])]
    return rows


def test_every_joint_has_its_actuator_and_its_limits(loaded: Loaded):
    plant, _ = loaded
    assert plant.num_actuators() == len(JOINTS)
    for i, name in enumerate(JOINTS):
        joint, actuator = plant.GetJointByName(name), plant.GetJointActuatorByName(name)
        assert actuator.joint().name() == name
        np.testing.assert_allclose(
            [joint.position_lower_limit(), joint.position_upper_limit()],
            [BOOM.limits.lower[i], BOOM.limits.upper[i]],
            rtol=0,
            atol=1e-15,
        )
    assert [plant.GetJointActuatorByName(name).effort_limit() for name in ("inner", "lower")] == pytest.approx([455.52] * 2)


def test_masses_are_the_booms(loaded: Loaded):
    plant, _ = loaded
    for name, body in {**BOOM.bodies, "tip": BOOM.payload}.items():
        assert plant.GetBodyByName(name).default_mass() == body.mass
    assert plant.CalcTotalMass(plant.CreateDefaultContext()) == pytest.approx(BOOM.mass + BOOM.payload.mass, rel=1e-14)


def test_gravity_torques_and_tip_are_the_models(loaded: Loaded):
    plant, G = loaded
    context = plant.CreateDefaultContext()
    q, *_ = random_states(BOOM, 100, np.random.default_rng(21))
    expected, tip = gravity_torque(BOOM, q), forward_kinematics(BOOM, q).position
    for k in range(len(q)):
        plant.SetPositions(context, G @ q[k])
        holding = -plant.CalcGravityGeneralizedForces(context) @ G
        assert np.abs(holding - expected[k]).max() < 5e-15 * np.abs(expected).max()
        position = plant.GetBodyByName("tip").EvalPoseInWorld(context).translation()
        np.testing.assert_allclose(position, tip[k], rtol=0, atol=5e-15)


@pytest.mark.parametrize("loaded", ["boom.xml"], indirect=True)
@pytest.mark.parametrize("factor", [1.0, 0.9], ids=["balanced", "too weak"])
def test_the_five_actuators_hold_the_linkage_through_its_loop(loaded: Loaded, factor: float):
    """Half a second on the holding torques; on nine tenths of them the boom sinks.

    Not of the URDF: Drake does not simulate a tree whose level links have no inertia.
    """
    plant, G = loaded
    simulator = Simulator(plant)
    context = simulator.get_mutable_context()
    q = BOOM.pose("phenotyping") - [0.0, 0.0, 0.5, 0.5, 0.0]  # away from every limit
    q[4] = 0.3
    plant.SetPositions(context, G @ q)
    torques = np.zeros(plant.num_actuators())
    for name, torque in zip(JOINTS, gravity_torque(BOOM, q), strict=True):
        torques[plant.GetJointActuatorByName(name).input_start()] = factor * torque
    plant.get_actuation_input_port().FixValue(context, torques)
    simulator.AdvanceTo(0.5)
    position = plant.GetBodyByName("tip").EvalPoseInWorld(context).translation()
    sunk = np.linalg.norm(position - forward_kinematics(BOOM, q).position)
    assert sunk < 1e-6 if factor == 1.0 else sunk > 0.05
    x = plant.GetPositions(context)
    own = x[[plant.GetJointByName(name).position_start() for name in JOINTS]]
    np.testing.assert_allclose(x, G @ own, rtol=0, atol=2e-6)
