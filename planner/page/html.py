"""HTML of the views: tables of numbers with units, bars, verdicts. Every text is escaped."""

from collections.abc import Iterable, Sequence
from html import escape

from planner.page.pose_view import Bar, Figure, fixed
from planner.recording.palette import GREEN, GREY, ORANGE, PURPLE, VERMILION, Color
from planner.recording.torque_ratio import BANDS

_CELL = "padding:1px 5px 1px 0;vertical-align:baseline"
_NUMBER = f"{_CELL};text-align:right;font-variant-numeric:tabular-nums"
_BAR = "height:9px;border-radius:2px"
_VERDICTS: dict[str, Color] = {"FAIL": VERMILION, "WARN": ORANGE, "PASS": GREEN, "INCO": PURPLE, "NOT ": PURPLE, "no d": GREY}


def css(color: Color) -> str:
    """Return a colour of the palette as CSS writes it."""
    return "rgb({},{},{})".format(*color)


def block(content: str) -> str:
    """Return content with the padding and the size of letters that the page's own fields have."""
    return f'<div style="padding:2px 10px 4px;font-size:12.5px;line-height:1.35">{content}</div>'


def complaint(name: str, text: str) -> str:
    """Return why a field's text was refused, to stand below the field."""
    said = escape(text)
    color = css(ORANGE)
    return block(f'<div id="complaint-{name}" role="alert" style="color:{color};margin-top:-6px">{said}</div>')


def figures_html(figures: Iterable[Figure]) -> str:
    """Return a table of numbers; one beyond a guideline is marked in words and in colour."""
    rows = []
    for each in figures:
        look = f"color:{css(ORANGE)}" if each.warns else ""
        said = " (low)" if each.warns else ""
        rows.append(
            f'<tr><td style="{_CELL}">{escape(each.label)}{said}</td>'
            f'<td style="{_NUMBER};{look}" id="{each.name}">{each.text}</td><td style="{_CELL}">{each.unit}</td></tr>'
        )
    return f'<table style="border-collapse:collapse;width:100%">{"".join(rows)}</table>'


def bars_html(bars: Iterable[Bar]) -> str:
    """Return each joint's static torque as a bar, whose full length is what its drive allows."""
    return "".join(map(_bar, bars))


def _bar(bar: Bar) -> str:
    torque = f'<span id="torque_{bar.joint}">{fixed(bar.torque, 2)}</span> {bar.unit}'
    if bar.limit is None or bar.used is None:
        return f'<div style="margin:4px 0"><b>{bar.joint}</b> {torque} <span style="opacity:.7">no drive</span></div>'
    color = css(next(color for bound, _, color in BANDS if bar.used <= bound))
    allowed = f'<span id="allowed_{bar.joint}">{fixed(bar.limit, 2)}</span> {bar.unit}'
    over = " over the limit" if bar.used > BANDS[-2][0] else ""
    return (
        f'<div style="margin:4px 0"><b>{bar.joint}</b> {torque} of {allowed} ({bar.decides}), '
        f'<span id="used_{bar.joint}">{fixed(bar.used, 2)}</span>{over}'
        f'<div style="background:rgba(128,128,128,.3);{_BAR}">'
        f'<div style="background:{color};{_BAR};width:{100.0 * min(bar.used, 1.0):.1f}%"></div></div></div>'
    )


def table_html(header: Sequence[str], rows: Iterable[Sequence[str]], name: str) -> str:
    """Return a table; a cell that is a verdict has its colour."""
    head = "".join(f'<th style="{_CELL};text-align:left">{escape(each)}</th>' for each in header)
    body = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in rows)
    return (
        f'<div style="overflow-x:auto"><table id="{name}" style="border-collapse:collapse;font-size:11px;white-space:nowrap">'
        f"<tr>{head}</tr>{body}</table></div>"
    )


def verdict_html(text: str) -> str:
    """Return a sentence that begins with a verdict, in its colour."""
    return f'<div id="verdict" style="font-weight:600;color:{_color(text)}">{escape(text)}</div>'


def lines_html(lines: Iterable[str]) -> str:
    """Return each line as a paragraph, in the colour of the verdict that it begins with."""
    return "".join(f'<div style="color:{_color(line)};margin-top:2px">{escape(line)}</div>' for line in lines)


def _cell(text: str) -> str:
    return f'<td style="{_CELL};color:{_color(text)}">{escape(text)}</td>'


def _color(text: str) -> str:
    color = _VERDICTS.get(text[:4])
    return "inherit" if color is None else css(color)
