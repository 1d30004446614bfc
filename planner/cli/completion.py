"""Types of option values, and shell completion of names."""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from boom_model import InputError
from boom_model.words import unknown

if TYPE_CHECKING:
    _Text = click.ParamType[str]
    _Number = click.ParamType[float]
else:
    _Text = _Number = click.ParamType  # not generic before click 8.2


class OneOf(_Text):
    """One of several words. The error for any other word suggests the nearest one."""

    name = "word"

    def __init__(self, words: Sequence[str]) -> None:
        """Set the known words."""
        self.words = tuple(words)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the word.

        Raises:
            InputError: the word is unknown.
        """
        if value in self.words:
            return str(value)
        raise unknown("value" if param is None else str(param.name).replace("_", " "), value, self.words)

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """Return the words with this beginning."""
        return _items(self.words, incomplete)


class Coordinate(_Number):
    """A coordinate [m], one of three numbers apart."""

    name = "float"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number.

        Raises:
            InputError: several numbers are joined by commas.
            click.BadParameter: it is no number.
        """
        if isinstance(value, str) and "," in value:
            raise InputError(f"{value}: X Y Z are three numbers apart, such as {value.strip(',').replace(',', ' ')}")
        return float(click.FLOAT.convert(value, param, ctx))


class OutFile(_Text):
    """Name of an output file with a given ending."""

    name = "file"

    def __init__(self, *endings: str) -> None:
        """Set the allowed endings."""
        self.endings = endings

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the name.

        Raises:
            InputError: the name has another ending.
        """
        name = str(value)
        if not name.endswith(self.endings):
            raise InputError(f"{name}: the name must end in {' or '.join(self.endings)}")
        return name

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """Return the files with this beginning."""
        return _files(incomplete)


def _items(words: Iterable[str], incomplete: str) -> list[CompletionItem]:
    return [CompletionItem(word) for word in words if word.startswith(incomplete)]


def _files(incomplete: str) -> list[CompletionItem]:
    return [CompletionItem(incomplete, type="file")]


def _listed(words: Iterable[str], incomplete: str) -> list[CompletionItem]:
    """Return the words that may stand after the last comma of a list."""
    before, comma, last = incomplete.rpartition(",")
    given = before.split(",")
    return [CompletionItem(f"{before}{comma}{word}") for word in words if word.startswith(last) and word not in given]


def any_file(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Complete the name of a file."""
    return _files(incomplete)


def pitches(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Complete a pitch."""
    return _items(("down", "level", "up", "free"), incomplete)


def kinds_of_path(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Complete the kind of a path."""
    return _items(("joint", "line", "arc="), incomplete)


def links(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Complete the name of a link that can be designed."""
    return _items(("inner", "lower", "outer", "extension"), incomplete)


def materials(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Complete a material."""
    return _items(("steel", "aluminium", "cfrp"), incomplete)


def profiles(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Complete a list of profiles."""
    from planner.timing.profile import Profile

    return _listed(("all", *Profile), incomplete)


def controllers(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Complete a list of controllers."""
    from planner.control.design import Controller

    return _listed(("all", *Controller), incomplete)


def shapers(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Complete a list of input shapers."""
    from planner.control.shaping import Shaper

    return _listed(("all", *Shaper), incomplete)


def targets(ctx: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Complete a target: the poses of --boom, or the beginning of a position."""
    from boom_model import Boom

    try:
        poses = Boom.load(ctx.params.get("boom_file")).poses
    except InputError:  # the command says what is wrong with the file
        poses = {}
    return _items((*poses, "tip=", "q="), incomplete)


def constraints(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Complete a constraint."""
    from boom_model.kinematics.constraints import WORDS

    return _items((*WORDS, "actuator=", "extension=", "nearest="), incomplete)


def joints(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Complete the name of a joint."""
    from boom_model import JOINTS

    return _items(JOINTS, incomplete)


def missions(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Complete the name of a mission or of a mission file."""
    from planner.missions.mission import named_missions

    return _items(named_missions(), incomplete) or _files(incomplete)


def vehicles(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Complete the name of a vehicle case or of a vehicle file."""
    from planner.motion.vehicle import named_cases

    return _items(named_cases(), incomplete) or _files(incomplete)


def studies(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Complete the name of a study, or of a file of one."""
    from planner.studies.study import named_studies

    return _items(named_studies(), incomplete) or _files(incomplete)
