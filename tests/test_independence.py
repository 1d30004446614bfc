"""Tests stand alone: what they share is in helpers, which are no tests, and nothing is planned to
collect them."""

import ast
from collections.abc import Iterator
from pathlib import Path

TESTS = Path(__file__).parent
FILES = {path.relative_to(TESTS): ast.parse(path.read_text(encoding="utf-8")) for path in sorted(TESTS.rglob("*.py"))}
SLOW = {"plan", "plan_motion", "plan_cycle", "timed", "follow", "design_link", "simulate", "certify"}
SLOW |= {"main_move", "planned_mission", "motion_along"}


def imports(tree: ast.AST) -> Iterator[str]:
    """Every module and name that a file imports, at its top or within a function."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module or ''}.{alias.name}" for alias in node.names)


def calls_at_import(node: ast.AST) -> Iterator[str]:
    """Names of the functions that run when a file is imported: all but those in the bodies of
    functions."""
    if isinstance(node, ast.Lambda):
        return
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        yield node.func.id
    if isinstance(node, ast.FunctionDef):
        parts: list[ast.AST] = [*node.decorator_list, node.args]
    else:
        parts = list(ast.iter_child_nodes(node))
    for part in parts:
        yield from calls_at_import(part)


def test_no_file_imports_a_test():
    for path, tree in FILES.items():
        tests = [name for name in imports(tree) if any(part.startswith("test_") for part in name.split("."))]
        assert not tests, path


def test_nothing_is_planned_at_import():
    for path, tree in FILES.items():
        assert not SLOW & set(calls_at_import(tree)), path
