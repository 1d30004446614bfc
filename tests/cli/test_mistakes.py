"""Plausible mistakes: what was typed, and the line that names what to type instead."""

import numpy as np
import pytest

from boom_model import Boom
from boom_model.boom_file import BOOM_FILE
from planner import plan, write_motion
from planner.motion.motion_files import read_motion

PLAN = ("plan", "transport", "phenotyping")

MISTAKES = [
    # names
    ("plna transport phenotyping", "No such command 'plna'. Did you mean 'plan'?"),
    ("plan transprot phenotyping", "unknown pose 'transprot'; did you mean transport? There are: phenotyping, transport"),
    ("plan Transport phenotyping", "did you mean transport?"),
    ("fk phenotypng", "did you mean phenotyping?"),
    ("mission table-31", "unknown mission 'table-31'; did you mean table-3-1? There are: field-day, table-2-4, table-3-1"),
    ("size field_day", "did you mean field-day?"),
    ("size table-3-1 --joint Inner", "unknown joint 'Inner'; did you mean inner?"),
    ("plan transport tip=1.4,0,1 --constraint horizonal", "unknown constraint 'horizonal'; did you mean horizontal?"),
    ("reach --constraint least_torque", "did you mean least-torque?"),
    ("plan transport phenotyping --vehicle slop", "unknown vehicle case 'slop'; did you mean slope?"),
    ("plan transport phenotyping --profile Cubic", "unknown profile 'Cubic'; did you mean cubic?"),
    ("plan transport phenotyping --profile time_optimal", "did you mean time-optimal?"),
    ("control transport phenotyping --controller computed_torque", "did you mean computed-torque?"),
    ("control transport phenotyping --profile cubik", "did you mean cubic?"),
    ("link --material steal", "unknown material 'steal'; did you mean steel?"),
    ("link --link iner", "unknown link 'iner'; did you mean inner?"),
    ("link --method exakt", "unknown method 'exakt'; did you mean exact?"),
    ("plan transport phenotyping --along lines", "unknown along 'lines'; did you mean line?"),
    ("check motion.csv --payload-as mas", "unknown payload as 'mas'; did you mean mass?"),
    ("plan transport phenotyping --boom wrong-motor.toml", "'MST341B2' is not in catalogue.toml"),
    # options
    ("plan transport phenotyping --profle cubic", "No such option '--profle'. Did you mean '--profile'?"),
    ("ik 1.4 0 1.0 --constrain horizontal", "Did you mean '--constraint'?"),
    ("check motion.csv --paylod 8", "Did you mean '--payload'?"),
    ("validate --jason", "Did you mean '--json'?"),
    ("plan transport phenotyping -payload 8", "No such option '-payload'. Did you mean '--payload'?"),
    ("plan phenotyping", "Missing argument 'GOAL'; it is called as boom plan START GOAL"),
    ("plan transport phenotyping home", "unexpected extra argument (home); it is called as boom plan START GOAL"),
    ("ik 1.4 0", "Missing argument 'Z'; it is called as boom ik X Y Z"),
    ("mission", "it is called as boom mission MISSION..."),
    ("compare motion.csv", "nothing to compare motion.csv with: give PLANNED before it, or --before FILE.toml"),
    ("torque motion.csv", "Missing option '--out'; it is called as boom torque IN --out OUT"),
    ("plan transport phenotyping --profile all", "unknown profile 'all'; there are: cubic, quintic"),
    ("plan transport phenotyping --via", "Option '--via' requires an argument"),
    ("plan transport phenotyping --average-torque", "average_torque is for the time-optimal profile, not for cubic"),
    ("plan transport phenotyping --via-velocity 1,2,3,4,5", "via velocity: 1 given for 0 via; give one for each"),
    # units
    ("link --deflection 10", "deflection is 10 m; it must be between 1e-06 and 1 m"),
    ("plan transport tip=1400,0,1000", "the nearest point on the line to the base that can be reached"),
    ("plan transport phenotyping --payload 10kg", "'10kg' is not a valid float"),
    ("plan transport phenotyping --payload -8", "payload"),
    ("plan q=0,90,180,0 transport", "'q=0,90,180,0' has 4 numbers; it needs 5, separated by commas"),
    ("plan q=0;90;180;0;0 transport", "'q=0;90;180;0;0' has 1 number; it needs 5, separated by commas"),
    ("plan 0,90,180,0,0 transport", "numbers are given as q=DEG,DEG,DEG,M,DEG or tip=X,Y,Z"),
    ("plan transport 1.4,0,1.0", "'1.4,0,1.0' is not the name of a pose; numbers are given as tip=1.4,0,1.0"),
    ("ik 1.4,0,1.0", "1.4,0,1.0: X Y Z are three numbers apart, such as 1.4 0 1.0"),
    ("plan transport tip=1.4,0,1 --constraint extension=0,25", "constraint extension: '0,25' is not metres"),
    ("plan transport tip=1.4,0,1 --constraint extension", "did you mean extension=M?"),
    ("plan transport tip=1.4,0,1 --pitch horizontal", "'horizontal' is not down, level, up, free or degrees"),
    ("plan transport phenotyping --along arc", "unknown along 'arc'; there are: joint, line, arc=X,Y,Z"),
    ("plan transport phenotyping --along line", "a line or an arc of the tip connects tip targets"),
    ("size table-3-1 --voltage 0", "voltage is 0 V; it must be between 0.1 and 1000 V"),
    ("link --thickness 5", "thickness is 5 m; it must be between 1e-05 and 1 m"),
    ("plan q=0,1.57,3.14,0,0 transport", "lower 3.14 deg is 1.86 deg below its limit of 5 deg"),
    ("check degrees.csv", "degrees.csv: q looks like degrees: q1 (yaw) reaches 90; angles must be in rad"),
    ("check degrees-of-q.csv", "degrees-of-q.csv: q looks like degrees; it must be in rad"),
    ("check milliseconds.csv", "milliseconds.csv: t looks like milliseconds"),
    ("torque bare-milliseconds.csv --out t.csv", "bare-milliseconds.csv: t looks like milliseconds"),
    ("compare motion.csv millimetres.csv", "millimetres.csv: q4 (extension) looks like millimetres: it reaches 1000"),
    # files
    ("plan transport phenotyping --out move.mp4", "move.mp4: the name must end in .rrd"),
    ("plan transport phenotyping --csv move.xlsx", "move.xlsx: the name must end in .csv"),
    ("plan transport phenotyping --report move.docx", "move.docx"),
    ("view motion.csv", "motion.csv: not a Rerun recording"),
    ("view", "no recording (.rrd) here; boom plan transport phenotyping makes one"),
    ("check nowhere.csv", "nowhere.csv: cannot be read: No such file or directory"),
    ("export-model boom.sdf", "must end in .urdf, or in .xml for MuJoCo"),
    ("export motion.csv move.json5", "must end in one of .csv, .parquet, .yaml, .yml, .json"),
    ("new mine", "mine: the name must end in .toml"),
    ("check semicolons.csv", "semicolons.csv: its columns are separated by semicolons; a motion's CSV has commas"),
    (
        "check old/a.rrd",
        "old/a.rrd: a recording is not read back; boom plan START GOAL --csv FILE.csv writes the motion of a plan",
    ),
    ("check wrong-motor.toml", "wrong-motor.toml: not a motion; it is the file of a boom, a vehicle or a mission"),
    ("mission wrong-motor.toml", "wrong-motor.toml: this is the file of a boom; give it as --boom wrong-motor.toml"),
    ("plan transport phenotyping --vehicle wrong-motor.toml", "give it as --boom wrong-motor.toml"),
    ("mission motion.csv", "unknown mission 'motion.csv'; there are: field-day, table-2-4, table-3-1, or a FILE.toml"),
    ("torque motion.csv --out motion.csv", "motion.csv: cannot be written: the same command reads it"),
    # order
    ("fk tip=1.4,0,1.0", "boom ik X Y Z finds those that reach it"),
    ("check transport phenotyping", "Got unexpected extra argument"),
    ("plan transport phenotyping --jerk-bound", "jerk_bound is for the time-optimal profile, not for cubic"),
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Files that people hand in: a motion as it should be, in other units, and a boom with a
    misspelt motor."""
    place = tmp_path_factory.mktemp("mistakes")
    boom = Boom.load()
    write_motion(plan(boom, "transport", "phenotyping").trajectory, place / "motion.csv")
    good = read_motion(place / "motion.csv")
    q, turn, length = good.q, np.degrees(1.0), np.array([0, 0, 0, 1, 0], dtype=bool)
    small = q * 0.05  # below what alone gives degrees away
    write(place / "degrees.csv", good.t, np.where(length, q, np.degrees(q)))
    write(place / "degrees-of-q.csv", good.t, np.where(length, small, small * turn), good.qd * 0.05, good.qdd * 0.05)
    write(place / "milliseconds.csv", 1e3 * good.t, q, good.qd, good.qdd)
    write(place / "bare-milliseconds.csv", np.rint(1e3 * good.t), q)
    write(place / "millimetres.csv", good.t, np.where(length, 1e3 * q, q))
    (place / "semicolons.csv").write_text("t;q1;q2;q3;q4;q5\n0;0;0;1;0;0\n1;0;0;1;0;0\n")
    (place / "old").mkdir()
    (place / "old" / "a.rrd").write_bytes(b"RRF2\x00\xff, not text\nat all")
    (place / "wrong-motor.toml").write_text(BOOM_FILE.read_text().replace("MST342C02", "MST341B2"))
    return place


def write(path, t, *arrays):
    names = ["t", *(f"{name}{i}" for name, _ in zip(("q", "qd", "qdd"), arrays, strict=False) for i in range(1, 6))]
    np.savetxt(path, np.column_stack([t, *arrays]), delimiter=",", header=",".join(names), comments="")


@pytest.mark.parametrize(("typed", "said"), MISTAKES, ids=[typed for typed, _ in MISTAKES])
def test_a_mistake_is_named_in_one_line(boom, folder, monkeypatch, typed, said):
    monkeypatch.chdir(folder)
    before = sorted(path.name for path in folder.iterdir())
    code, out, err = boom(*typed.split())
    assert code in (1, 2)
    assert out == ""
    assert said in err
    assert err.startswith("boom: ")
    assert err.count("\n") == 1
    assert sorted(path.name for path in folder.iterdir()) == before


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        ("plan transport phenotyping --constraint horizontal", "note: --constraint has no effect: no target is a tip=X,Y,Z"),
        ("plan transport phenotyping --pitch level", "note: --pitch has no effect: no target is a tip=X,Y,Z"),
        ("plan transport tip=1.4,0,1 --pitch -1.5708", "note: pitch -1.5708 is in degrees; -1.5708 rad would be -90"),
        ("ik 1.4 0 1 --pitch -0.785", "note: pitch -0.785 is in degrees; -0.785 rad would be -45"),
        ("plan transport phenotyping --pass-via", "note: --pass-via has no effect: no --via is given"),
        ("size table-3-1 --joint inner", "not tried: gearbox CSF-20-50-2UH and 24 more: no efficiency, no-load torque"),
    ],
)
def test_what_is_hardly_meant_is_said(boom, typed, said):
    code, out, err = boom(*typed.split())
    assert (code, err) == (0, "")
    assert said in " ".join(out.split())


def test_a_file_that_is_replaced_is_named_as_replaced(boom):
    assert "recording: move.rrd\n" in boom(*PLAN)[1]
    assert "recording: move.rrd, replaced\n" in boom(*PLAN)[1]


def test_a_motion_in_si_is_no_mistake(boom, folder, monkeypatch):
    monkeypatch.chdir(folder)
    assert boom("check", "motion.csv")[0] == 0


@pytest.mark.parametrize("width", [80, 140])
@pytest.mark.parametrize("payload", ["40", "1000"])
def test_an_answer_that_is_no_is_short_too(boom, monkeypatch, width, payload):
    monkeypatch.setenv("COLUMNS", str(width))
    code, out, err = boom(*PLAN, "--payload", payload, "--vehicle", "slope")
    assert code == 1
    assert len(out.splitlines()) <= 24
    assert "FAIL gearbox hold: inner" in out
    assert " more that FAIL or WARN\n" in out
    assert len(err) < 200
    listed = boom(*PLAN, "--payload", payload, "--vehicle", "slope", "--all")[1]
    assert "more that FAIL" not in listed
    assert listed.count("\nFAIL ") > out.count("\nFAIL ")


def test_a_duration_beyond_all_torque_is_told_in_words(boom):
    code, _, err = boom(*PLAN, "--duration", "0.1")
    assert code == 1
    assert "lower would be too fast for its motor to give any torque" in err
    assert "inf" not in err
