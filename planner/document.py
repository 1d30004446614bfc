"""A report as a document to keep: Markdown, HTML or PDF, with its pictures, the versions and the command that made it."""

import io
import shlex
import sys
from base64 import b64encode
from collections.abc import Mapping
from html import escape
from importlib.metadata import version
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
_LIBRARIES = ("numpy", "scipy", "toppra", "ruckig", "control", "coal")
_STYLE = (
    "body{font-family:sans-serif;max-width:75em;margin:2em auto;padding:0 1em;color:#222}"
    "table{border-collapse:collapse;font-size:.85em}td,th{border:1px solid #bbb;padding:.25em .5em;text-align:left}"
    "th{background:#eee}img{max-width:100%}code{background:#f3f3f3}"
)


def require_form(path: str) -> None:
    """Whether a document can have that name.

    Raises:
        InputError: its ending is none of FORMS.
    """
    if Path(path).suffix not in FORMS:
        raise InputError(f"{path}: a report is written as {', '.join(FORMS)}")


def command_line() -> str:
    """The command that is running, as it would be typed."""
    return shlex.join(["boom", *sys.argv[1:]])


def write_document(path: str | Path, markdown: str, pictures: Mapping[str, "Figure"]) -> None:
    """Writes a report with its pictures by title, the command line and the versions behind it.

    HTML and PDF hold their pictures; those of Markdown lie beside it as FILE-1.png, FILE-2.png and so on.

    Raises:
        InputError: the ending is unknown, or a file cannot be written; an old one is left as it was.
    """
    require_form(str(path))
    path = Path(path)
    drawn = {title: _png(figure) for title, figure in pictures.items()}
    versions = ", ".join(f"{name} {version(name)}" for name in ("boom", *_LIBRARIES))
    made = f"Made by `{command_line()}` with {versions}, Python {sys.version.split()[0]}."
    if path.suffix == ".md":
        content = f"{markdown.rstrip()}\n"
        for k, (title, png) in enumerate(drawn.items(), start=1):
            beside = path.with_name(f"{path.stem}-{k}.png")
            with replacing(beside) as temporary:
                Path(temporary).write_bytes(png)
            content += f"\n## {title}\n\n![{title}]({beside.name})\n"
        data = f"{content}\n---\n\n{made}\n".encode()
    elif path.suffix == ".html":
        data = _html(path.stem, markdown, drawn, made).encode()
    else:
        data = _pdf(markdown, drawn, made)
    with replacing(path) as temporary:
        Path(temporary).write_bytes(data)


def _html(title: str, markdown: str, drawn: Mapping[str, bytes], made: str) -> str:
    from markdown_it import MarkdownIt

    render = MarkdownIt("commonmark", {"html": False}).enable("table").render
    head = f'<meta charset="utf-8"><title>{escape(title)}</title><style>{_STYLE}</style>'
    pictures = "".join(
        f'<h2>{escape(name)}</h2>\n<img alt="{escape(name)}" src="data:image/png;base64,{b64encode(png).decode()}">\n'
        for name, png in drawn.items()
    )
    body = f"{render(markdown)}{pictures}<hr>\n{render(made)}"
    return f'<!doctype html>\n<html lang="en"><head>{head}</head>\n<body>\n{body}</body></html>\n'


def _pdf(markdown: str, drawn: Mapping[str, bytes], made: str) -> bytes:
    """Headings, paragraphs, lists and tables set one after the other, then a page for each picture."""
    from fpdf import FPDF
    from markdown_it import MarkdownIt
    from markdown_it.tree import SyntaxTreeNode

    pdf = FPDF(orientation="landscape", format="A4")
    pdf.set_font("helvetica", size=_TEXT)
    pdf.add_page()
    for node in SyntaxTreeNode(MarkdownIt("commonmark").enable("table").parse(f"{markdown}\n\n{made}\n")).children:
        if node.type == "table":
            _set_table(pdf, [[_text(cell) for cell in row.children] for part in node.children for row in part.children])
        elif node.type == "heading":
            size = _TEXT + (5 if node.tag == "h1" else 3)
            pdf.ln(3)
            pdf.set_font("helvetica", "B", size)
            pdf.multi_cell(0, size / 2, _text(node), align="L", new_x="LMARGIN", new_y="NEXT")
            pdf.set_font("helvetica", size=_TEXT)
            pdf.ln(1)
        else:
            for line in node.children if node.type == "bullet_list" else [node]:
                pdf.multi_cell(0, _TEXT / 2, ("- " if node.type == "bullet_list" else "") + _text(line), align="L",
                               new_x="LMARGIN", new_y="NEXT")  # fmt: skip
    for title, png in drawn.items():
        pdf.add_page()
        pdf.set_font("helvetica", "B", _TEXT + 3)
        pdf.cell(0, 8, title, new_x="LMARGIN", new_y="NEXT")
        pdf.image(io.BytesIO(png), w=pdf.epw, h=pdf.eph - 10, keep_aspect_ratio=True)
    return bytes(pdf.output())


def _set_table(pdf: "FPDF", rows: list[list[str]]) -> None:
    """A table whose columns are as wide as their longest word asks for, and beyond that as their text."""
    columns = list(zip(*rows, strict=True))
    longest = [max(len(word) for cell in column for word in cell.split() or [""]) for column in columns]
    mean = [sum(map(len, column)) / len(column) for column in columns]
    widths = [least + average for least, average in zip(longest, mean, strict=True)]
    pdf.set_font("helvetica", size=_TEXT - 1)
    with pdf.table(rows, col_widths=widths, text_align="LEFT", line_height=_TEXT / 2.2, padding=0.6):
        pass
    pdf.set_font("helvetica", size=_TEXT)


def _text(node: "SyntaxTreeNode") -> str:
    """A node's text in the characters of a PDF's own fonts."""
    if not node.children:
        return str(node.content).encode("latin-1", "replace").decode("latin-1")
    return "".join(_text(child) for child in node.children)


def _png(figure: "Figure") -> bytes:
    data = io.BytesIO()
    figure.savefig(data, format="png")
    return data.getvalue()
