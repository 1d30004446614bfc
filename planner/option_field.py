"""Fields of a description that become options of a command, with help text, form and bounds."""

from dataclasses import dataclass, field, fields
from typing import Any

from boom_model.plausible import Range


@dataclass(frozen=True)
class OptionField:
    """What a command says of a field of a description."""

    help: str
    form: str | None = None
    """What the user types for a value."""
    choices: tuple[str, ...] = ()
    quantity: Range | None = None
    """Bounds of a number."""
    flag: str | None = None
    """Text of a flag that is not the field's own name, such as --no-buckling."""

    @property
    def negates(self) -> bool:
        """Whether the flag sets the field to false."""
        return self.flag is not None and "/" not in self.flag


def option_field(
    default: Any,
    help: str,
    form: str | None = None,
    *,
    choices: tuple[str, ...] = (),
    quantity: Range | None = None,
    flag: str | None = None,
) -> Any:
    """Return a field of a dataclass that becomes an option."""
    return field(default=default, metadata={"option": OptionField(help, form, choices, quantity, flag)})


def options_of(description: Any) -> dict[str, OptionField]:
    """Return the fields of a dataclass that are options, by name and in order."""
    return {each.name: each.metadata["option"] for each in fields(description) if "option" in each.metadata}
