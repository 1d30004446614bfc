"""Tables and lists as Markdown."""

from collections.abc import Iterable, Sequence


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """The lines of a table; a bar within a cell is escaped."""
    escaped = [[cell.replace("|", "\\|") for cell in row] for row in (header, *rows)]
    return ["| " + " | ".join(line) + " |" for line in (escaped[0], ["---"] * len(header), *escaped[1:])]


def section(title: str, texts: Sequence[str]) -> list[str]:
    """The lines of a heading and its list, after an empty line; none where there is nothing to list."""
    return ["", f"## {title}", "", *(f"- {text}" for text in texts)] if texts else []
