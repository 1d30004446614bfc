"""Logs as files: every form, what is assumed, a refusal that names the line, and a thousand mutated
logs."""

import re
from datetime import UTC, datetime

import numpy as np
import pytest

from boom_model import InputError
from planner.field.earth import coordinates_in
from planner.field.geotag import geotag
from planner.field.log_files import read_joint_log, read_triggers, read_vehicle_log
from planner.field.vehicle_log import VehicleLog
from tests.field.field_files import ANTENNA, write_field
from tests.field.motions import Drive

HEAD = "utc,latitude_deg,longitude_deg,height_m,roll_deg,pitch_deg,heading_deg,quality"


def written(folder, header, *rows):
    place = folder / "log.csv"
    place.write_text("\n".join([header, *rows]) + "\n")
    return place


def row(k, latitude=52.13, longitude=-106.62, height=480.0, quality=4):
    return f"2026-07-01T15:00:{k:02d}Z,{latitude + 1e-5 * k},{longitude},{height},0,0,0,{quality}"


def test_every_form_of_position_gives_the_same(tmp_path):
    drive, t = Drive(), np.arange(0.0, 3.0, 0.5)
    ecef = drive.point(t, ANTENNA)
    angles = ",".join(["0.5", "-0.2", "41.0"])
    utm = coordinates_in(32613, ecef)
    given = {
        "x_m,y_m,z_m": ecef,
        "easting_m,northing_m,height_m": utm,
        "latitude_deg,longitude_deg,height_m": coordinates_in(4326, ecef)[:, [1, 0, 2]],
    }
    for columns, values in given.items():
        rows = [f"{at},{','.join(f'{x:.12f}' for x in v)},{angles}" for at, v in zip(t, values, strict=True)]
        place = written(tmp_path, f"t,{columns},roll_deg,pitch_deg,heading_deg", *rows)
        log = read_vehicle_log(place, 32613 if "easting" in columns else None)
        assert log.ecef == pytest.approx(ecef, abs=2e-6)
        assert log.angles == pytest.approx(np.tile(np.radians([0.5, -0.2, 41.0]), (len(t), 1)), abs=1e-9)
        assert any("assumed standard deviation of the position 3 m" in note for note in log.notes)


def test_clocks_give_the_same_instants(tmp_path):
    """15:00:00 UTC on 1 July 2026 in four ways; GPS time is 18 s ahead, and its week began on
    Sunday 28 June."""
    instant = datetime(2026, 7, 1, 15, 0, 0, tzinfo=UTC).timestamp()
    week = (datetime(2026, 6, 28, tzinfo=UTC) - datetime(1980, 1, 6, tzinfo=UTC)).days // 7
    gps = week * 604800 + 3 * 86400 + 15 * 3600 + 18
    for header, cell in (
        ("utc", "2026-07-01T15:00:00Z"),
        ("utc", "2026-07-01T09:00:00-06:00"),
        ("utc", repr(instant)),
        ("gps_s", str(gps)),
    ):
        triggers = read_triggers(written(tmp_path, header, cell))
        assert (triggers.t[0], triggers.clock) == (instant, "utc")


@pytest.mark.parametrize(
    ("header", "rows", "message"),
    [
        (HEAD, [row(0), row(1, latitude=-106.62, longitude=52.13)], r"line 3: latitude is -106.6\d* deg; .* swapped"),
        (HEAD, [row(0, 0.90984, -1.8608), row(1, 0.90984, -1.8608)], "line 2: .* looks like radians"),
        (HEAD, [row(0), row(2), row(1)], "line 4: the time goes back by 1 s; split the log"),
        (HEAD, [row(0), row(1, height=1e5)], "line 3: height is 100000 m"),
        (HEAD, [row(0), row(1, quality=12)], "line 3: quality is 12"),
        (HEAD.replace("quality", "std_heading_deg"), [row(0), row(1, quality=-1)], "line 3: std_heading is -1 deg"),
        (HEAD.replace("quality", "std_heading_deg"), [row(0), row(1, quality=1e20)], r"line 3: std_heading is 1e\+20 deg"),
        (HEAD, [row(0, quality=0), row(1, quality=0)], "no row has a fix"),
        (HEAD, [row(0), row(1).replace("2026-07-01T15:00:01Z", "2026-07-01T15:00:01")], "line 3: utc is .*, without a zone"),
        (HEAD, [row(0), row(1).replace("52.13", "fifty")], "line 3: latitude_deg is .*; it must be a number"),
        (HEAD, [row(0), row(1).replace("480.0", "nan")], "line 3: height_m is 'nan'; it must be finite"),
        (HEAD, [row(0), row(1) + ",9"], "line 3: 9 cells; the header has 8"),
        (
            HEAD.replace("heading_deg", "Heading_deg"),
            [row(0), row(1)],
            "'Heading_deg'; did you mean heading_deg?",
        ),
        (HEAD.replace("height_m", "altitude_m"), [row(0), row(1)], "altitude_m is above the sea"),
        (HEAD.replace("utc", "time of day"), [row(0), row(1)], "it needs one of t .*, utc .* and gps_s"),
        (HEAD.replace("utc", "gps_s"), [row(0).replace("2026-07-01T15:00:00Z", "313218")], "seconds of a week need their week"),
        (HEAD.replace("roll_deg", "roll_rad"), [row(0), row(1).replace(",0,0,0,", ",30,0,0,")], "line 3: roll is 1718"),
        (HEAD.replace("quality", "roll_deg"), [row(0), row(1)], "line 1: column 'roll_deg' is there twice"),
        (HEAD, [], "no rows under a header"),
        ("t,easting_m,northing_m,height_m", ["0,389000,5776000,480", "1,389000,5776001,480"], "need --epsg CODE"),
        (
            "t,easting_m,northing_m,height_m,epsg",
            ["0,389000,5776000,480,32613", "1,389000,5776001,480,32614"],
            "line 3: EPSG is 32614, and line 2 has 32613; a log must have one code",
        ),
        (
            "t,easting_m,northing_m,height_m,epsg",
            ["0,5776000,389000,480,32613", "1,5776001,389000,480,32613"],
            "easting and northing are swapped",
        ),
        ("t,x_m,y_m,z_m", ["0,1,2,3", "1,1,2,3"], "line 2: x, y, z is .* from the earth's centre"),
        ("t,latitude_deg,longitude_deg,height_m", ["0,52,-106,480", "1,52,-106,480"], "no heading, and the track stays within"),
    ],
)
def test_refused_with_its_line(header, rows, message, tmp_path):
    with pytest.raises(InputError, match=message):
        read_vehicle_log(written(tmp_path, header, *rows))


def test_rows_without_a_fix_and_repeated_ones_are_noted(tmp_path):
    rows = [row(0), row(1), row(1), row(2).rsplit(",", 1)[0] + ",0", *(row(k) for k in range(3, 9))]
    log = read_vehicle_log(written(tmp_path, HEAD, *rows))
    assert len(log.t) == 8
    assert log.warnings == (f"{tmp_path / 'log.csv'}: 1 line without a fix left out: 5",)
    assert any("1 rows that repeat the one above" in note for note in log.notes)


def test_heading_of_the_track_is_said_to_be_biased(tmp_path):
    rows = [f"{0.1 * k},{52.13 + 1e-6 * k},{-106.62 + 1e-6 * k},480" for k in range(100)]
    log = read_vehicle_log(written(tmp_path, "t,latitude_deg,longitude_deg,height_m", *rows))
    assert any("side slip" in note for note in log.notes)
    expected = np.arctan2(np.cos(np.radians(52.13)) * 6.391e6, 6.375e6)  # radii of curvature of WGS 84 there
    assert log.angles[:, 2] == pytest.approx(np.full(100, expected), abs=2e-3)


def test_joints_in_degrees_or_millimetres_are_refused(tmp_path):
    head = "t,q1,q2,q3,q4,q5"
    with pytest.raises(InputError, match=r"line 3: q1 \(yaw\) is 90 rad; it looks like degrees"):
        read_joint_log(written(tmp_path, head, "0,0,1,3,0.5,0", "1,90,1,3,0.5,0"))
    with pytest.raises(InputError, match=r"line 2: q4 \(extension\) is 500 m; it looks like millimetres"):
        read_joint_log(written(tmp_path, head, "0,0,1,3,500,0", "1,1,1,3,0.5,0"))
    with pytest.raises(InputError, match="column q5 is missing"):
        read_joint_log(written(tmp_path, "t,q1,q2,q3,q4", "0,0,1,3,0"))


# NMEA


def sentence(text):
    value = 0
    for letter in text:
        value ^= ord(letter)
    return f"${text}*{value:02X}"


def nmea(t, drive, *, heading=True):
    """GGA, RMC, GST and PASHR at times of 1 July 2026, 23:59:50 UTC on."""
    latitude, longitude, height = (np.degrees(x) if i < 2 else x for i, x in enumerate(_geodetic(drive, t)))
    lines = []
    for k, at in enumerate(t):
        second = 86390.0 + at
        clock = f"{int(second // 3600) % 24:02d}{int(second // 60) % 60:02d}{second % 60.0:05.2f}"
        day = "010726" if second < 86400.0 else "020726"
        north = f"{int(latitude[k])}{(latitude[k] % 1.0) * 60.0:010.7f},N"
        west = f"{int(-longitude[k])}{(-longitude[k] % 1.0) * 60.0:010.7f},W"
        lines.append(sentence(f"GNRMC,{clock},A,{north},{west},2.7,40.0,{day},,,R"))
        lines.append(sentence(f"GNGGA,{clock},{north},{west},4,18,0.7,{height[k] + 20.0:.4f},M,-20.0,M,1.0,0000"))
        lines.append(sentence(f"GNGST,{clock},0.01,0.02,0.01,10.0,0.011,0.012,0.021"))
        if heading:
            roll, pitch, bearing = np.degrees(drive.angles(np.array([at]))[0])
            lines.append(sentence(f"PASHR,{clock},{bearing:.5f},T,{roll:.5f},{pitch:.5f},0.00,0.05,0.05,0.1,2,1"))
    return lines


def _geodetic(drive, t):
    from planner.field.earth import geodetic_of

    return geodetic_of(drive.point(t, ANTENNA))


def test_nmea_over_midnight(tmp_path):
    drive, t = Drive(), np.arange(0.0, 20.0, 0.25)
    lines = nmea(t, drive)
    lines[9] = lines[9].replace("GNGGA", "GNGGB")  # its checksum is now wrong
    place = tmp_path / "log.nmea"
    place.write_text("\r\n".join(lines) + "\r\n")
    log = read_vehicle_log(place)
    assert log.clock == "utc"
    assert log.t[0] == datetime(2026, 7, 1, 23, 59, 50, tzinfo=UTC).timestamp()
    assert log.t[-1] - log.t[0] == 19.75
    kept = np.delete(t, 2)
    assert np.linalg.norm(log.ecef - drive.point(kept, ANTENNA), axis=-1).max() < 2e-4
    assert log.angles == pytest.approx(drive.angles(kept), abs=2e-7)
    assert np.sqrt(np.diagonal(log.position_covariance[5])) == pytest.approx([0.012, 0.011, 0.021])
    assert any("1 line broken or with a wrong checksum, left out: 10" in note for note in log.notes)
    (tmp_path / "log.nmea").write_text("\n".join(line for line in nmea(t, drive, heading=False)))
    assert any("side slip" in note for note in read_vehicle_log(place).notes)


def test_nmea_attitude_turns_on_the_sphere_between_its_sentences(tmp_path):
    """Attitude at every fourth fix alone, over north: halfway in angle, never by way of 180 deg."""
    drive, t = Drive(begin=-0.05, turning=0.02, sway=0.001), np.arange(0.0, 6.0, 0.25)
    lines = [line for k, line in enumerate(nmea(t, drive)) if "PASHR" not in line or k // 4 % 4 == 0]
    place = tmp_path / "log.nmea"
    place.write_text("\r\n".join(lines))
    log = read_vehicle_log(place)
    inside = log.t - log.t[0] <= 5.0
    off = (log.angles - drive.angles(t) + np.pi) % (2.0 * np.pi) - np.pi
    assert np.abs(off[inside]).max() < 0.001 * 1.9**2 / 8.0 * 1.1  # of a line under a sine, over one second
    assert any("a fix is 0.75 s from the nearest attitude" in note for note in log.notes)


def test_nmea_without_a_date_is_refused(tmp_path):
    place = tmp_path / "log.nmea"
    place.write_text("\n".join(line for line in nmea(np.arange(3.0), Drive()) if "RMC" not in line))
    with pytest.raises(InputError, match="no sentence RMC or ZDA gives the date"):
        read_vehicle_log(place)


# Mutations


def test_a_thousand_mutated_logs_are_read_or_refused_in_a_line(tmp_path):
    """Bytes, cells and lines changed, lost, doubled: never anything but a log or one clear line."""
    names = write_field(tmp_path, Drive(), 2.0)
    lines = nmea(np.arange(0.0, 8.0, 0.5), Drive())
    (tmp_path / "log.nmea").write_text("\r\n".join(lines))
    readers = [(names["vehicle"], read_vehicle_log), (names["joints"], read_joint_log), (names["triggers"], read_triggers),
               (str(tmp_path / "log.nmea"), read_vehicle_log)]  # fmt: skip
    random, messages = np.random.default_rng(11), []
    for k in range(1000):
        source, read = readers[k % 4]
        data = _mutated(random, (tmp_path / source).read_bytes())
        place = tmp_path / "mutated.csv"
        place.write_bytes(data)
        try:
            log = read(place)
        except InputError as error:
            messages.append(str(error))
        else:
            assert np.isfinite(log.t).all()
            if isinstance(log, VehicleLog):
                tags = geotag(log, {"sensor": [0.2, 2.5, -2.0]}, log.t[:20] + 0.01)["sensor"]
                assert np.isfinite(tags.covariance[tags.known]).all()
    assert len(messages) > 300
    assert not [text for text in messages if "\n" in text or len(text) > 500]
    assert not [text for text in messages if not re.search(r"line \d|row|column|fix|no |not |it has", text)]


STRANGE = (b"", b"nan", b"1e999", b"-", b"inf", b"1e5", b"0", b"\xff", b"\x00", b'"', b"99999999999999999999")


def _mutated(random, data):
    kind = random.integers(7)
    if kind == 0:  # a byte
        at = random.integers(len(data))
        return data[:at] + bytes([random.integers(256)]) + data[at + 1 :]
    lines = data.split(b"\n")
    at = random.integers(len(lines))
    if kind == 1:
        return b"\n".join([*lines[:at], *lines[at + 1 :]])
    if kind == 2:
        other = random.integers(len(lines))
        lines[at], lines[other] = lines[other], lines[at]
        return b"\n".join(lines)
    if kind == 3:
        return data[: random.integers(len(data))]
    cells = lines[at].split(b",")
    i = random.integers(len(cells))
    if kind == 4:
        cells[i] = [b"", b"nan", b"1e999", b"-", b"inf", b"1e5", b"0", b"\xff", b"\x00", b'"', b"99999999999999999999"][
            random.integers(11)
        ]
    elif kind == 5:
        del cells[i]
    else:
        cells[i] = b"-" + cells[i]
    lines[at] = b",".join(cells)
    return b"\n".join(lines)
