"""Okabe and Ito's palette, which the colour-blind can tell apart, and what each colour stands for."""

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
"""Of the bodies. A joint's line has the colour of the body that it moves."""

JOINT_COLORS = dict(zip(JOINTS, (COLORS[b] for b in ("base", "inner", "lower", "extension", "end_effector")), strict=True))
PART_COLORS = dict(zip((f.name for f in fields(Breakdown)), (SKY_BLUE, GREEN, YELLOW, ORANGE, GREY, PURPLE), strict=True))
MOVE_COLORS = (ORANGE, SKY_BLUE, GREEN, YELLOW, PURPLE, LIGHT, BLUE, GREY)
"""Of several moves in one recording, in turn."""

LIMIT_COLOR = VERMILION
PIN_COLOR = DARK
PAYLOAD_COLOR = LIGHT
TOTAL_COLOR = LIGHT
OUTSIDE_COLOR: Color = (90, 90, 90)
