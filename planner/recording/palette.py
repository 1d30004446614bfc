"""Okabe and Ito's palette, readable with colour blindness, and the meaning of each colour."""

from dataclasses import fields

from boom_model import JOINTS, Breakdown

Color = tuple[int, int, int]

GREY: Color = (153, 153, 153)
YELLOW: Color = (240, 228, 66)
SKY_BLUE: Color = (86, 180, 233)
GREEN: Color = (0, 158, 115)
ORANGE: Color = (230, 159, 0)
BLUE: Color = (0, 114, 178)
VERMILION: Color = (213, 94, 0)
PURPLE: Color = (204, 121, 167)
LIGHT: Color = (230, 230, 230)
DARK: Color = (60, 60, 60)

COLORS: dict[str, Color] = {
    "base": GREY,
    "lower": YELLOW,
    "inner": SKY_BLUE,
    "outer": GREEN,
    "upper": ORANGE,
    "extension": BLUE,
    "end_effector": PURPLE,
}
"""Colours of the bodies. The line of a joint has the colour of the body that the joint moves."""

JOINT_COLORS = dict(zip(JOINTS, (COLORS[b] for b in ("base", "inner", "lower", "extension", "end_effector")), strict=True))
PART_COLORS = dict(zip((f.name for f in fields(Breakdown)), (SKY_BLUE, GREEN, YELLOW, ORANGE, GREY, PURPLE), strict=True))
MOVE_COLORS = (ORANGE, SKY_BLUE, GREEN, YELLOW, PURPLE, LIGHT, BLUE, GREY)
"""Colours of several moves in one recording, in this order."""

LIMIT_COLOR = VERMILION
AFTER_COLOR = GREEN
"""A model as identified."""

PIN_COLOR = DARK
PAYLOAD_COLOR = LIGHT
TOTAL_COLOR = LIGHT
OUTSIDE_COLOR: Color = (90, 90, 90)
