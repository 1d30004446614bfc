"""TOML files: read by a pydantic schema, with errors that name file and key; edited."""

import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic_core import ErrorDetails

from boom_model.errors import InputError

if TYPE_CHECKING:
    from tomlkit import TOMLDocument

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class Table(BaseModel):
    """A TOML table: no unknown keys, no numbers written as text."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


Schema = TypeVar("Schema", bound=Table)

_OF_A_BOOM = {"geometry", "bodies", "joints"}
_LONGEST = 40  # digits or letters of a value that a message shows


def read_toml(path: Path, schema: type[Schema]) -> Schema:
    """Read a TOML file into an instance of `schema`.

    Raises:
        InputError: the file cannot be read, is not TOML, or does not match the schema; the message
            names every wrong key.
    """
    return validated(str(path), parse_toml(path), schema)


def parse_toml(path: Path) -> dict[str, Any]:
    """Return the file as nested dictionaries, held to no schema.

    Raises:
        InputError: the file cannot be read, or is not TOML.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except ValueError as error:  # not TOML, not UTF-8, or an integer of thousands of digits
        raise InputError(f"{path}: not valid TOML: {error}") from None
    except RecursionError:
        raise InputError(f"{path}: not valid TOML: arrays or tables are nested too deep") from None


def editable_toml(path: Path) -> "TOMLDocument":
    """Return the file as a document that keeps its comments when it is written again.

    Raises:
        InputError: the file cannot be read, or is not TOML.
    """
    import tomlkit
    from tomlkit.exceptions import TOMLKitError

    try:
        return tomlkit.parse(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except (TOMLKitError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not valid TOML: {error}") from None


def validated(name: str, data: dict[str, Any], schema: type[Schema]) -> Schema:
    """Nested dictionaries as an instance of `schema`; `name` is of the file in messages.

    Raises:
        InputError: the data breaks the schema; every offending key is named.
    """
    try:
        return schema.model_validate(data)
    except ValidationError as error:
        if data.keys() >= _OF_A_BOOM and not schema.model_fields.keys() >= _OF_A_BOOM:
            raise InputError(f"{name}: this is the file of a boom; give it as --boom {name}") from None
        raise InputError(f"{name}: " + "; ".join(_sentence(e) for e in error.errors())) from None


def _sentence(error: ErrorDetails) -> str:
    key = ".".join(str(part) for part in error["loc"])
    if error["type"] == "missing":
        return f"key {key} is missing"
    if error["type"] == "extra_forbidden":
        return f"key {key} is not known"
    value = error["input"]
    shown = f" (it is {_shown(value)})" if isinstance(value, int | float | str) else ""
    return f"key {key}: {error['msg'][0].lower()}{error['msg'][1:]}{shown}"


def _shown(value: int | float | str) -> str:
    if isinstance(value, int) and abs(value) >= 10**_LONGEST:
        return f"an integer of more than {_LONGEST} digits"
    text = repr(value)
    return text if len(text) <= 2 * _LONGEST else f"{text[:_LONGEST]}..."
