"""The shipped catalogue against the sheets' tables, typed a second time, and against itself."""

import re
from dataclasses import fields
from itertools import pairwise, product

import numpy as np
import pytest

from boom_model import Catalogue
from boom_model.drives.drive import Wiring

SHIPPED = Catalogue.load()
ENTRIES = [*SHIPPED.motors.values(), *SHIPPED.gearboxes.values(), *SHIPPED.actuators.values()]
RPM, LITTLE = 2 * np.pi / 60, 1e-12
RATIOS = (50, 80, 100, 120, 160)

# Harmonic Drive, general catalogue 2025, table 127-1: rated torque at 2000 rpm, limits of the
# repeated peak, of the average and of the momentary peak [Nm], by size and ratio.
CSF = {
    20: {50: (25, 56, 34, 98), 80: (34, 74, 47, 127), 100: (40, 82, 49, 147), 120: (40, 87, 49, 147), 160: (40, 92, 49, 147)},
    25: {
        50: (39, 98, 55, 186),
        80: (63, 137, 87, 255),
        100: (67, 157, 108, 284),
        120: (67, 167, 108, 304),
        160: (67, 176, 108, 314),
    },
    32: {
        50: (76, 216, 108, 382),
        80: (118, 304, 167, 568),
        100: (137, 333, 216, 647),
        120: (137, 353, 216, 686),
        160: (137, 372, 216, 686),
    },
    40: {
        50: (137, 402, 196, 686),
        80: (206, 519, 284, 980),
        100: (265, 568, 372, 1080),
        120: (294, 617, 451, 1180),
        160: (294, 647, 451, 1180),
    },
}

# The same of CSG, table 126-1.
CSG = {
    (20, 100): (52, 107, 64, 191),
    (25, 50): (51, 127, 72, 242),
    (25, 100): (87, 204, 140, 369),
    (32, 100): (178, 433, 281, 841),
    (40, 100): (345, 738, 484, 1400),
}

# Both tables: largest and largest average input speed with grease [rpm], inertia [1e-4 kg m^2].
BY_SIZE = {20: (6500, 3500, 0.193), 25: (5600, 3500, 0.413), 32: (4800, 3500, 1.69), 40: (4000, 3000, 4.5)}
STRAIN_WAVE = [("CSF", *key) for key in product(CSF, RATIOS)] + [("CSG", *key) for key in CSG]

# Harmonic Drive LLC, catalogue "CSF & CSG Series", tables 42 (ratio 50) and 43 (80 and more):
# T1, T2 [Nm]; K1, K2, K3 [Nm/mrad].
STIFFNESS = {
    20: ((7, 25), (13, 18, 23), (16, 25, 29)),
    25: ((14, 48), (25, 34, 44), (31, 50, 57)),
    32: ((29, 108), (54, 78, 98), (67, 110, 120)),
    40: ((54, 196), (100, 140, 180), (130, 200, 230)),
}

# Trinamic QMOT QSH8618 manual V1.08, table 2.1: holding torque [Nm], mass [kg], rotor inertia
# [g cm^2], largest voltage [V], and of each wiring current [A], resistance [ohm], inductance [mH],
# voltage [V].
QSH8618 = {
    "65-59-340": (3.4, 1.7, 1000, 100, {"parallel": (5.9, 0.28, 1.7, 1.65), "series": (3.0, 1.14, 6.8, 3.42)}),
    "80-55-460": (4.6, 2.3, 1400, 140, {"single": (5.5, 0.42, 3.5, 2.3)}),
    "96-55-700": (7.0, 2.8, 2700, 140, {"single": (5.5, 0.45, 4.5, 2.56)}),
    "118-60-870": (8.7, 3.8, 2700, 140, {"single": (6.0, 0.45, 5.1, 2.7)}),
    "156-62-1280": (12.8, 5.4, 4000, 160, {"single": (6.2, 0.75, 9.0, 3.5)}),
}

# Yaskawa Sigma-7 manual, section 4.2.2, page 4-4: rated and instantaneous maximum torque [Nm],
# rotor inertia [kg cm^2].
SGM7J = {"02A": (0.637, 2.23, 0.263), "04A": (1.27, 4.46, 0.486), "06A": (1.91, 6.69, 0.800), "08A": (2.39, 8.36, 1.59)}

# Kollmorgen TBM(S) selection guide: continuous and peak stall torque [Nm], rotor inertia [kg m^2],
# mass [kg].
TBM = {
    "6013-A": (0.413, 1.37, 1.41e-5, 0.213),
    "6025-A": (0.706, 2.56, 2.52e-5, 0.377),
    "6051-A": (1.16, 4.53, 4.75e-5, 0.550),
}

# Linearmech catalogue, page 36, table 5.1, ratio RV: peak, continuous (standing) and nominal force
# [N], speed [mm/s], lead of the screw [mm], efficiency [%].
SA_PD = {
    "SA0PD-BS1": (1080, 360, 330, 250, 5, 82),
    "SA0PD-BS2": (550, 180, 165, 500, 10, 83),
    "SA1PD-BS1": (1075, 355, 325, 250, 5, 81),
    "SA1PD-BS2": (545, 175, 160, 500, 10, 83),
    "SA2PD-BS1": (2140, 710, 610, 250, 5, 81),
    "SA2PD-BS2": (1095, 365, 310, 500, 10, 83),
    "SA2PD-BS3": (690, 230, 195, 800, 16, 84),
    "SA3PD-BS1": (4490, 1495, 1390, 235, 5, 79),
    "SA3PD-BS2": (2315, 770, 715, 470, 10, 82),
    "SA3PD-BS3": (1175, 390, 360, 940, 20, 84),
}

# LINAK data sheet LA31: force [N], speed [mm/s] and self-locking force [N], by the pitch [mm].
LA31 = {3: (3500, 5, 3500), 6: (2500, 10, 2500)}

# Beckhoff AG2400, pages TP004 MF and TP010 MF, one stage: weight [kg], backlash [arcmin]; then by
# ratio inertia with the hub E of 19 mm [kg cm^2], nominal, acceleration and emergency stop torque
# [Nm], nominal input speed [rpm], idle torque [Nm].
AG2400 = {
    "TP004": (
        1.4,
        4,
        {
            4: (0.57, 27, 66, 100, 3300, 0.56),
            5: (0.54, 27, 66, 100, 3300, 0.48),
            7: (0.51, 26, 66, 100, 4000, 0.37),
            8: (0.51, 26, 42, 100, 4000, 0.37),
            10: (0.49, 27, 42, 100, 4000, 0.31),
        },
    ),
    "TP010": (
        3.8,
        3,
        {
            4: (0.95, 84, 172, 250, 2600, 1.3),
            5: (0.79, 81, 172, 250, 2900, 1.1),
            7: (0.64, 81, 172, 251, 3100, 0.84),
            8: (0.64, 80, 126, 251, 3100, 0.84),
            10: (0.57, 81, 126, 251, 3100, 0.64),
        },
    ),
}
AG_UNITS = [(size, ratio) for size, (*_, ratios) in AG2400.items() for ratio in ratios]


def close(value):
    return pytest.approx(value, rel=LITTLE, abs=0)


def gear(series, size, ratio):
    return SHIPPED.gearboxes[f"{series}-{size}-{ratio}-2UH"]


# Every entry


def test_every_entry_is_in_a_table_of_the_tests():
    thesis = {"MST340B02", "MST341B02", "MST342B02", "MST342C02"}  # see the tests of the boom's file
    assert set(SHIPPED.motors) == thesis | {"AS1060"} | {
        *(f"QSH8618-{name}" for name in QSH8618),
        *(f"SGM7J-{name}" for name in SGM7J),
        *(f"TBM-{name}" for name in TBM),
    }
    planetary = {f"{size}-{ratio}" for size, ratio in AG_UNITS}
    strain_wave = {f"{series}-{size}-{ratio}-2UH" for series, size, ratio in STRAIN_WAVE}
    assert set(SHIPPED.gearboxes) == {"CBG320160"} | planetary | strain_wave
    assert set(SHIPPED.actuators) == {*SA_PD, *(f"LA31-{pitch}mm" for pitch in LA31)}


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.name)
def test_every_entry_names_maker_and_sheet_and_no_figure_is_zero(entry):
    makers = ("JVL", "Trinamic", "Beckhoff", "Yaskawa", "Kollmorgen", "Cone Drive", "Harmonic Drive", "Linearmech", "LINAK")
    assert entry.source.startswith(makers)
    where = ("page", "table", "section", "guide", "technical data", "technical specifications", "catalogue")
    assert any(word in entry.source for word in where)
    figures = [getattr(entry, f.name) for f in fields(entry)]
    assert all(figure > 0.0 for figure in figures if isinstance(figure, float | int))


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.name)
def test_every_copy_of_a_sheet_is_named(entry):
    """Who buys by a copied figure can look at the text: owner, repository and path are there."""
    named = re.findall(r"as copied in github\.com/[\w-]+/[\w.-]+, [\w.-]+/[\w./-]+\w", entry.source)
    assert len(named) == entry.source.count("copied")
    assert "public" not in entry.source


@pytest.mark.parametrize("entry", SHIPPED.gearboxes.values(), ids=lambda entry: entry.name)
def test_the_torques_of_a_gearbox_are_in_order(entry):
    rising = [entry.continuous_torque, entry.max_average_torque, entry.start_stop_torque, entry.peak_torque]
    printed = [torque for torque in rising if torque is not None]
    assert all(one < other for one, other in pairwise(printed))
    assert (entry.torsion_torques is None) is (entry.torsion_stiffness is None) is (entry.peak_events is not None)
    if entry.torsion_torques is not None:
        first, second = entry.torsion_torques
        assert first < second
        assert all(one < other for one, other in pairwise(entry.torsion_stiffness))


@pytest.mark.parametrize("ratio", RATIOS)
def test_a_larger_gearbox_is_stronger_stiffer_and_slower(ratio):
    for small, large in pairwise(gear("CSF", size, ratio) for size in CSF):
        for name in ("continuous_torque", "max_average_torque", "start_stop_torque", "peak_torque", "input_inertia"):
            assert getattr(small, name) < getattr(large, name)
        assert all(one < other for one, other in zip(small.torsion_stiffness, large.torsion_stiffness, strict=True))
        assert small.max_input_speed > large.max_input_speed


@pytest.mark.parametrize(("size", "ratio"), CSG)
def test_csg_is_about_30_percent_stronger_than_csf(size, ratio):
    """The maker says of both series: 30 % more torque and 43 % more life (10,000 and 7,000 h)."""
    strong, plain = gear("CSG", size, ratio), gear("CSF", size, ratio)
    for name in ("continuous_torque", "max_average_torque", "start_stop_torque", "peak_torque"):
        assert getattr(strong, name) / getattr(plain, name) == pytest.approx(1.3, abs=0.01)
    assert strong.rated_L10 / plain.rated_L10 == close(10 / 7)
    assert strong.torsion_stiffness == plain.torsion_stiffness


def test_cone_drives_gearbox_has_the_stiffness_of_its_size():
    """Both makers print the same curve for size 32: one sheet read against the other."""
    cone, harmonic = SHIPPED.gearboxes["CBG320160"], gear("CSF", 32, 160)
    assert cone.torsion_torques == close(harmonic.torsion_torques)
    assert cone.torsion_stiffness == close(harmonic.torsion_stiffness)


# Gearboxes


@pytest.mark.parametrize(("series", "size", "ratio"), STRAIN_WAVE)
def test_csf_and_csg_are_those_of_the_rating_tables(series, size, ratio):
    largest, mean, inertia = BY_SIZE[size]
    found = gear(series, size, ratio)
    torques = (found.continuous_torque, found.start_stop_torque, found.max_average_torque, found.peak_torque)
    assert torques == (CSF[size][ratio] if series == "CSF" else CSG[size, ratio])
    assert found.ratio == ratio
    assert (found.max_input_speed, found.max_average_input_speed) == close((largest * RPM, mean * RPM))
    assert found.input_inertia == close(inertia * 1e-4)
    assert found.rated_input_speed == close(2000 * RPM)
    assert found.rated_L10 == {"CSF": 7000, "CSG": 10_000}[series] * 3600.0
    assert found.efficiency is None


@pytest.mark.parametrize(("series", "size", "ratio"), STRAIN_WAVE)
def test_stiffness_is_that_of_the_catalogues_tables(series, size, ratio):
    torques, of_50, of_more = STIFFNESS[size]
    found = gear(series, size, ratio)
    assert found.torsion_torques == close(torques)
    assert found.torsion_stiffness == close([1e3 * k for k in (of_50 if ratio == 50 else of_more)])


def test_what_only_some_units_print():
    found = gear("CSF", 25, 50)
    assert (found.mass, found.starting_torque, found.backdrive_torque) == (1.5, 0.15, 9.0)
    strain_wave = {name: g for name, g in SHIPPED.gearboxes.items() if g.peak_events is None}
    masses = {name: g.mass for name, g in strain_wave.items() if g.mass is not None}
    csg = {"CSG-20-100-2UH": 0.98, "CSG-25-100-2UH": 1.5, "CSG-32-100-2UH": 3.2}
    assert masses == {"CBG320160": 3.3, "CSF-25-50-2UH": 1.5} | csg


@pytest.mark.parametrize(("size", "ratio"), AG_UNITS)
def test_ag2400_is_that_of_beckhoffs_page(size, ratio):
    weight, arcmin, ratios = AG2400[size]
    inertia, nominal, acceleration, stop, speed, idle = ratios[ratio]
    found = SHIPPED.gearboxes[f"{size}-{ratio}"]
    assert (found.ratio, found.mass, found.peak_events) == (ratio, weight, 1000)
    assert (found.continuous_torque, found.start_stop_torque, found.peak_torque) == (nominal, acceleration, stop)
    assert (found.no_load_input_torque, found.efficiency) == (idle, close(0.97))
    assert found.input_inertia == close(inertia * 1e-4)
    assert found.backlash == pytest.approx(np.radians(arcmin / 60), rel=1e-4)
    assert (found.max_input_speed, found.max_average_input_speed) == close((7500 * RPM, speed * RPM))
    assert found.rated_life is found.rated_L10 is found.max_average_torque is None


# Motors


@pytest.mark.parametrize("name", QSH8618)
def test_qsh8618_is_that_of_table_2_1(name):
    holding, mass, rotor, volts, windings = QSH8618[name]
    motor = SHIPPED.motors[f"QSH8618-{name}"]
    assert (motor.holding_torque, motor.mass, motor.max_voltage) == (holding, mass, volts)
    assert motor.rotor_inertia == close(rotor * 1e-7)
    assert motor.step == close(np.radians(1.8))
    assert motor.running_torque is None  # a picture
    assert {wiring.value for wiring in motor.windings} == set(windings)
    for wiring, (current, resistance, inductance, voltage) in windings.items():
        found = motor.windings[Wiring(wiring)]
        assert (found.current, found.resistance) == (current, resistance)
        assert found.inductance == close(inductance / 1e3)
        # The sheet's voltage is current times resistance, but for the longest motor.
        if name != "156-62-1280":
            assert current * resistance == pytest.approx(voltage, rel=0.04)


def test_as1060_is_that_of_beckhoffs_page():
    motor = SHIPPED.motors["AS1060"]
    assert (motor.holding_torque, motor.mass, motor.max_voltage) == (5.0, 2.85, 50.0)
    assert motor.rotor_inertia == close(3.0e-4)
    assert (motor.single.current, motor.single.resistance) == (5.0, 0.36)
    assert motor.single.inductance == close(2.80e-3)


@pytest.mark.parametrize("name", SGM7J)
def test_sgm7j_is_that_of_page_4_4(name):
    rated, peak, rotor = SGM7J[name]
    motor = SHIPPED.motors[f"SGM7J-{name}"]
    assert (motor.rated_torque, motor.peak_torque) == (rated, peak)
    assert motor.rotor_inertia == close(rotor * 1e-4)
    assert (motor.rated_speed, motor.max_speed) == close((3000 * RPM, 6000 * RPM))
    watts = 100 * int(name[:2])  # by the maker's designation; "08" is 750 W
    assert rated * 3000 * RPM == pytest.approx({800: 750}.get(watts, watts), rel=0.01)
    assert motor.peak_torque / motor.rated_torque == pytest.approx(3.5, rel=0.01)


@pytest.mark.parametrize("name", TBM)
def test_tbm_is_that_of_the_selection_guide(name):
    stall, peak, rotor, mass = TBM[name]
    motor = SHIPPED.motors[f"TBM-{name}"]
    assert (motor.rated_torque, motor.peak_torque, motor.mass) == (stall, peak, mass)
    assert motor.rotor_inertia == close(rotor)
    assert motor.rated_speed is None  # the continuous torque is that at stall


def test_a_motor_is_a_stepper_or_a_servo():
    for motor in SHIPPED.motors.values():
        if motor.is_servo:
            assert motor.rated_torque < motor.peak_torque
            assert not motor.windings
            assert motor.holding_torque is motor.running_torque is None
        else:
            assert motor.windings
            assert motor.rated_torque is motor.peak_torque is None
            assert motor.running_torque is None or motor.running_torque < motor.holding_torque


# Actuators


@pytest.mark.parametrize("name", SA_PD)
def test_sa_pd_is_that_of_table_5_1(name):
    peak, standing, nominal, speed, lead, percent = SA_PD[name]
    found = SHIPPED.actuators[name]
    assert (found.peak_force, found.static_force, found.rated_force) == (peak, standing, nominal)
    assert nominal < standing < peak
    assert (found.max_speed, found.lead, found.efficiency) == close((speed / 1e3, lead / 1e3, percent / 100))
    # One motor on several screws: its torque is F lead / (2 pi efficiency), as the sheet rounds.
    first = SA_PD[f"{name[:-1]}1"]
    assert peak * lead / percent == pytest.approx(first[0] * first[4] / first[5], rel=0.06)


@pytest.mark.parametrize("pitch", LA31)
def test_la31_is_that_of_linaks_sheet(pitch):
    force, speed, locks = LA31[pitch]
    found = SHIPPED.actuators[f"LA31-{pitch}mm"]
    assert (found.peak_force, found.backdrive_force) == (force, locks)
    assert (found.max_speed, found.lead, found.duty) == close((speed / 1e3, pitch / 1e3, 0.1))
