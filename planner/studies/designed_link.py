"""A link designed anew for a sample: the least mass that carries the mission's own loads."""

from boom_model import Boom, InputError
from boom_model.link_design import LINKS, Material, least_mass, link_body, with_body
from boom_model.link_design.link import link_of
from boom_model.words import unknown
from planner.links.loads import link_cases
from planner.links.task import LinkTask
from planner.missions.mission import Cycle
from planner.studies.tables import Tree

LINK_FIELDS = (
    "link",
    "material",
    "safety_factor",
    "deflection",
    "thickness",
    "min_height",
    "max_height",
    "max_taper",
    "slices",
)
"""Fields of a `LinkTask` that a study may give."""

NO_LINK = "none"
"""Value of link.link that leaves the boom's links as they are."""


def link_task(given: Tree) -> LinkTask | None:
    """Return the task of a designed link; None if there is none.

    Raises:
        InputError: a field is of the wrong type or out of its range, or the link is unknown.
    """
    if not given or given.get("link") == NO_LINK:
        return None
    for name, value in given.items():
        wanted = str if name in ("link", "material") else float
        if not isinstance(value, str if wanted is str else int | float) or isinstance(value, bool):
            raise InputError(f"link.{name} is {value!r}; it must be a {'word' if wanted is str else 'number'}")
    task = LinkTask(**{**given, "slices": int(given.get("slices", LinkTask.slices))})
    if task.link not in LINKS:
        raise unknown("link", task.link, (*LINKS, NO_LINK))
    return task


def with_designed_link(boom: Boom, task: LinkTask, links: Tree, cycle: Cycle) -> tuple[Boom, float]:
    """Return the boom with a link of least mass under a cycle's loads, and the link's mass [kg].

    As `design_link` by the exact method on the loads of moves, without its comparisons.

    Raises:
        InputError: the link or the material is unknown, or a figure is out of its range.
        InfeasibleError: no heights keep the limits.
    """
    link = link_of(boom, task.link, links, "the links' file")
    link = task.sized(link)
    material = Material.load(task.material)
    beam = link.beam(material, task.slices)
    limits = task.limits(material)
    cases, _ = link_cases(boom, link, [leg.trajectory for leg in cycle.legs if leg.moves])
    body = link_body(link, beam, least_mass(beam, cases, limits).heights)
    return with_body(boom, link.name, body), body.mass
