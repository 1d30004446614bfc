"""Documents of reports in Markdown, HTML or PDF.

A document contains the report, its pictures, the versions of the libraries, and the command that
made it.
"""

import io
import os
import re
import shlex
import sys
from base64 import b64encode
from collections.abc import Iterable, Mapping
from html import escape
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING

from boom_model.errors import InputError
from planner.files import replacing

if TYPE_CHECKING:
    from fpdf import FPDF
    from markdown_it.tree import SyntaxTreeNode
    from matplotlib.figure import Figure

FORMS = (".md", ".html", ".pdf")
_TEXT = 8  # [pt]
_PADDING = 0.6  # [mm]
_WITH_HEADING = 25.0  # [mm], least space below a heading on its page
_LEAST_PICTURE = 50.0  # [mm], least height left for the picture of the first page
_FIRST = "The move"
_VERDICTS = {"FAIL": "#b00020", "WARN": "#a15c00", "INCOMPLETE": "#7a3b8f", "PASS": "#00663d"}
_Lead = tuple[str, bytes] | None
"""Markdown and picture of a first page."""
_LIBRARIES = ("numpy", "scipy", "toppra", "ruckig", "control")
_STYLE = (
    "body{font-family:sans-serif;max-width:75em;margin:2em auto;padding:0 1em;color:#222}"
    "table{border-collapse:collapse;font-size:.85em}td,th{border:1px solid #bbb;padding:.25em .5em;text-align:left}"
    "th{background:#eee}img{max-width:100%}code{background:#f3f3f3}"
) + "".join(f".{verdict}{{color:{color}}}" for verdict, color in _VERDICTS.items())


def require_form(path: str) -> None:
    """Check that the name ends in one of FORMS.

    Raises:
        InputError: the name has another ending.
    """
    if Path(path).suffix not in FORMS:
        raise InputError(f"{path}: a report is written as {', '.join(FORMS)}")


def is_picture_of(document: str | Path, path: str | Path) -> bool:
    """Whether a report in Markdown may write one of its pictures to `path`."""
    report, other = Path(os.path.realpath(document)), Path(os.path.realpath(path))
    name = re.fullmatch(rf"{re.escape(report.stem)}-[0-9]+\.png", other.name)
    return report.suffix == ".md" and other.parent == report.parent and name is not None


def command_line() -> str:
    """Return the running command as it would be typed."""
    return shlex.join(["boom", *sys.argv[1:]]).encode(errors="backslashreplace").decode()


def without_pictures(markdown: str) -> str:
    r"""Return Markdown with its pictures and tags as plain text.

    Text from a TOML file could otherwise load pictures from any address.

    >>> print(without_pictures("![x](http://a/b.png) <img src=c> 1 < 2"))
    !\[x](http://a/b.png) \<img src=c> 1 < 2
    """
    return re.sub(r"<(?=[A-Za-z/!?])", r"\\<", markdown.replace("![", r"!\["))


def write_document(
    path: str | Path,
    markdown: str,
    pictures: Mapping[str, "Figure"],
    first: tuple[str, "Figure"] | None = None,
    command: str | None = None,
) -> None:
    """Write a report with its pictures by title, the command line and the library versions.

    Args:
        path: the file.
        markdown: the report.
        pictures: by title, set after the report.
        first: Markdown and picture of a first page, if there is one.
        command: the command that makes the report; None is the running one.

    HTML and PDF files contain their pictures. A Markdown file refers to pictures beside it, named
    FILE-1.png, FILE-2.png and so on.

    Args:
        path: the file.
        markdown: the report.
        pictures: figures by title.
        command: the command that makes this report; None is the running one.

    Raises:
        InputError: the ending is unknown, or a file cannot be written. An existing file is left
            unchanged.
    """
    require_form(str(path))
    path, markdown = Path(path), without_pictures(markdown)
    drawn = {title: _png(figure) for title, figure in pictures.items()}
    lead = None if first is None else (without_pictures(first[0]), _png(first[1]))
    made = f"Made by `{command or command_line()}` with {', '.join(_versions())}, Python {sys.version.split()[0]}."
    with replacing(path) as temporary:
        place = Path(temporary)
        if path.suffix == ".md":
            shown = drawn if lead is None else {_FIRST: lead[1]} | drawn
            names = {title: f"{path.stem}-{k}.png" for k, title in enumerate(shown, start=1)}
            for title, png in shown.items():
                _write(place.with_name(names[title]), png)  # moves along
            content = "" if lead is None else f"{lead[0].rstrip()}\n\n![{_FIRST}]({names[_FIRST]})\n\n"
            content += f"{markdown.strip()}\n"
            content += "".join(f"\n## {title}\n\n![{title}]({names[title]})\n" for title in drawn)
            _write(place, _encoded(f"{content}\n---\n\n{made}\n"))
        elif path.suffix == ".html":
            _write(place, _encoded(_html(path.stem, markdown, drawn, made, lead)))
        else:
            _write(place, _pdf(markdown, drawn, made, lead))


def _write(place: Path, data: bytes) -> None:
    with replacing(place) as temporary:
        Path(temporary).write_bytes(data)


def _encoded(text: str) -> bytes:
    return text.encode(errors="backslashreplace")  # a file's name may hold any byte


def _versions() -> list[str]:
    found = [f"{name} {version(name)}" for name in ("boom", *_LIBRARIES)]
    try:
        return [*found, f"coal {version('coal')}"]
    except PackageNotFoundError:  # it comes with the extra keep-out
        return found


def _html(title: str, markdown: str, drawn: Mapping[str, bytes], made: str, lead: _Lead = None) -> str:
    from markdown_it import MarkdownIt

    render = MarkdownIt("commonmark", {"html": False}).enable("table").render
    head = f'<meta charset="utf-8"><title>{escape(title)}</title><style>{_STYLE}</style>'

    def picture(name: str, png: bytes) -> str:
        return f'<img alt="{escape(name)}" src="data:image/png;base64,{b64encode(png).decode()}">\n'

    begins = "" if lead is None else render(lead[0]) + picture(_FIRST, lead[1])
    begins = re.sub(rf"<strong>({'|'.join(_VERDICTS)})", r'<strong class="\1">\1', begins)
    pictures = "".join(f"<h2>{escape(name)}</h2>\n{picture(name, png)}" for name, png in drawn.items())
    body = f"{begins}{render(markdown)}{pictures}<hr>\n{render(made)}"
    return f'<!doctype html>\n<html lang="en"><head>{head}</head>\n<body>\n{body}</body></html>\n'


def _pdf(markdown: str, drawn: Mapping[str, bytes], made: str, lead: _Lead = None) -> bytes:
    """Return a PDF: a first page, the text with its tables, then a page for each picture."""
    from fpdf import FPDF

    pdf = FPDF(orientation="landscape", format="A4")
    pdf.set_font("helvetica", size=_TEXT)
    pdf.add_page()
    if lead is not None:
        _set_markdown(pdf, lead[0])
        if pdf.eph + pdf.t_margin - pdf.y < _LEAST_PICTURE:
            pdf.add_page()
        pdf.image(io.BytesIO(lead[1]), w=pdf.epw, h=pdf.eph + pdf.t_margin - pdf.y - 2.0, keep_aspect_ratio=True)
        pdf.add_page()
    _set_markdown(pdf, f"{markdown}\n\n{made}\n")
    for title, png in drawn.items():
        pdf.add_page()
        pdf.set_font("helvetica", "B", _TEXT + 3)
        pdf.cell(0, 8, title, new_x="LMARGIN", new_y="NEXT")
        pdf.image(io.BytesIO(png), w=pdf.epw, h=pdf.eph - 10, keep_aspect_ratio=True)
    return bytes(pdf.output())


def _set_markdown(pdf: "FPDF", markdown: str) -> None:
    """Set text and tables.

    A paragraph that begins with a verdict has its colour. A thematic break begins a page.
    """
    from markdown_it import MarkdownIt
    from markdown_it.tree import SyntaxTreeNode

    for node in SyntaxTreeNode(MarkdownIt("commonmark").enable("table").parse(markdown)).children:
        if node.type == "table":
            pdf.ln(2)
            _set_table(pdf, [[_text(cell) for cell in row.children] for part in node.children for row in part.children])
        elif node.type == "hr":
            pdf.add_page()
        elif node.type == "heading":
            size = _TEXT + (5 if node.tag == "h1" else 3)
            pdf.ln(3)
            if pdf.will_page_break(_WITH_HEADING):
                pdf.add_page()
            pdf.set_font("helvetica", "B", size)
            pdf.multi_cell(0, size / 2, _text(node), align="L", new_x="LMARGIN", new_y="NEXT")
            pdf.set_font("helvetica", size=_TEXT)
            pdf.ln(1)
        else:
            pdf.ln(1)
            pdf.set_text_color(_VERDICTS.get(_text(node).partition(":")[0], "#000000"))
            for line in node.children if node.type == "bullet_list" else [node]:
                pdf.multi_cell(0, _TEXT / 2, ("- " if node.type == "bullet_list" else "") + _text(line), align="L",
                               new_x="LMARGIN", new_y="NEXT")  # fmt: skip
            pdf.set_text_color("#000000")


def _set_table(pdf: "FPDF", rows: list[list[str]]) -> None:
    """Set a table no wider than the page.

    Every column is wide enough for its longest word; only the widest columns wrap their text.
    """
    size = float(_TEXT - 1)
    pdf.set_font("helvetica", "B", size)  # words are widest in the header's font
    padding = 2.0 * _PADDING + 0.5

    def widest(texts: Iterable[str]) -> float:
        return max(map(pdf.get_string_width, texts), default=0.0) + padding

    columns = list(zip(*rows, strict=True))
    least = [widest(word for cell in column for word in cell.split()) for column in columns]
    whole = [widest(column) for column in columns]
    shrink = min(1.0, pdf.epw / sum(least))
    widths = _capped([x * shrink for x in least], [x * shrink for x in whole], pdf.epw)
    pdf.set_font("helvetica", size=size * shrink)
    with pdf.table(
        rows,
        width=min(sum(widths), pdf.epw),
        col_widths=widths,
        align="LEFT",
        text_align="LEFT",
        line_height=0.55 * size * shrink,
        padding=_PADDING,
    ):
        pass
    pdf.set_font("helvetica", size=_TEXT)
    pdf.ln(2)


def _capped(least: list[float], whole: list[float], available: float) -> list[float]:
    """Return the full widths, cut to a common cap so that their sum is at most `available`.

    No width is cut below its value in `least`.
    """
    low, high = 0.0, max(whole)
    if sum(whole) <= available:
        return whole
    for _ in range(40):
        cap = (low + high) / 2.0
        fits = sum(max(few, min(all_, cap)) for few, all_ in zip(least, whole, strict=True)) <= available
        low, high = (cap, high) if fits else (low, cap)
    return [max(few, min(all_, low)) for few, all_ in zip(least, whole, strict=True)]


def _text(node: "SyntaxTreeNode") -> str:
    """Return the text of a node in the characters of the fonts built into PDF."""
    if not node.children:
        return str(node.content).encode("latin-1", "replace").decode("latin-1")
    return "".join(_text(child) for child in node.children)


def _png(figure: "Figure") -> bytes:
    data = io.BytesIO()
    figure.savefig(data, format="png")
    return data.getvalue()
