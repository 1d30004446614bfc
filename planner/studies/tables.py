"""Nested tables as TOML gives them: dotted keys, changed copies, and texts with placeholders."""

from collections.abc import Iterator, Mapping
from typing import Any

from boom_model.errors import InputError
from boom_model.words import nearest_name

Tree = dict[str, Any]
Value = float | str | bool


def get(tree: Any, path: tuple[str, ...]) -> Any:
    """Return what stands at a path; a part of a path into a list is its index, from 0.

    Raises:
        KeyError: nothing stands there.
    """
    for part in path:
        if isinstance(tree, Mapping):
            tree = tree[part]
        elif isinstance(tree, list) and part.isdigit() and int(part) < len(tree):
            tree = tree[int(part)]
        else:
            raise KeyError(part)
    return tree


def put(tree: Any, path: tuple[str, ...], value: Any) -> Any:
    """Return a copy with another value at a path; what is not on the path is shared."""
    if not path:
        return value
    first, rest = path[0], path[1:]
    if isinstance(tree, list):
        index = int(first)
        return [put(part, rest, value) if i == index else part for i, part in enumerate(tree)]
    return {**tree, first: put(tree.get(first, {}), rest, value)}


def scaled(value: Any, factor: float) -> Any:
    """Return a number, or a list of numbers, times a factor."""
    if isinstance(value, list):
        return [scaled(part, factor) for part in value]
    return value * factor


def is_numeric(value: Any) -> bool:
    """Whether a value is a number, or a list of numbers."""
    if isinstance(value, list):
        return bool(value) and all(map(is_numeric, value))
    return isinstance(value, int | float) and not isinstance(value, bool)


def merged(tree: Tree, changes: Tree) -> Tree:
    """Return a copy with the keys of `changes` added or replaced, table by table."""
    both = {
        key: merged(tree[key], value) if isinstance(value, dict) and isinstance(tree.get(key), dict) else value
        for key, value in changes.items()
    }
    return {**tree, **both}


def keys(tree: Any, prefix: str = "") -> Iterator[str]:
    """Yield the dotted key of every value, tables' and lists' own among them."""
    parts = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for name, value in parts:
        key = f"{prefix}.{name}" if prefix else str(name)
        yield key
        yield from keys(value, key)


def require_key(tree: Tree, key: str, where: str) -> Any:
    """Return what stands at a dotted key.

    Raises:
        InputError: nothing stands there; suggests the nearest key.
    """
    try:
        return get(tree, tuple(key.split(".")))
    except KeyError:
        meant = nearest_name(key, keys(tree))
        hint = "" if meant is None else f"; did you mean {meant}?"
        raise InputError(f"{where}: unknown key {key!r}{hint}") from None


def filled(tree: Any, values: Mapping[str, Value]) -> Any:
    """Return a copy with every placeholder {name} in its texts replaced by that name's value."""
    if isinstance(tree, dict):
        return {key: filled(value, values) for key, value in tree.items()}
    if isinstance(tree, list):
        return [filled(value, values) for value in tree]
    if isinstance(tree, str):
        for name, value in values.items():
            tree = tree.replace(f"{{{name}}}", f"{value:.12g}" if isinstance(value, float) else str(value))
    return tree


def texts(tree: Any) -> Iterator[str]:
    """Yield every text of a tree."""
    if isinstance(tree, str):
        yield tree
    for part in tree.values() if isinstance(tree, dict) else tree if isinstance(tree, list) else ():
        yield from texts(part)
