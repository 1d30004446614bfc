"""Tables and lists in Markdown."""

from collections.abc import Iterable, Sequence


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Return the lines of a table, with vertical bars in cells escaped."""
    escaped = [[cell.replace("|", "\\|") for cell in row] for row in (header, *rows)]
    return ["| " + " | ".join(line) + " |" for line in (escaped[0], ["---"] * len(header), *escaped[1:])]


def section(title: str, texts: Sequence[str]) -> list[str]:
    """Return the lines of a heading and its list after an empty line, or none for an empty list."""
    return ["", f"## {title}", "", *(f"- {text}" for text in texts)] if texts else []
