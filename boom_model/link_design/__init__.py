"""Shape of a link of least mass within limits of stress, deflection and buckling.

This is the link design of the thesis, chapter 3. The package holds the beam model with its
stresses, deflections and buckling loads, the exact and the thesis's design methods, and finite
elements to check a design.
"""

from boom_model.link_design.beam import Beam, Forces, LoadCases, deflection, internal_forces, mass, stress_height, von_mises
from boom_model.link_design.buckling import critical_load, euler_load
from boom_model.link_design.exact import Design, least_mass
from boom_model.link_design.limits import Limits
from boom_model.link_design.link import LINKS, Link, link_body, load_link, with_body
from boom_model.link_design.materials import Material
from boom_model.link_design.search import stress_only
from boom_model.link_design.thesis_method import THESIS_LOAD, ThesisDesign, ThesisLoad, thesis_design

__all__ = [
    "LINKS",
    "THESIS_LOAD",
    "Beam",
    "Design",
    "Forces",
    "Limits",
    "Link",
    "LoadCases",
    "Material",
    "ThesisDesign",
    "ThesisLoad",
    "critical_load",
    "deflection",
    "euler_load",
    "internal_forces",
    "least_mass",
    "link_body",
    "load_link",
    "mass",
    "stress_height",
    "stress_only",
    "thesis_design",
    "von_mises",
    "with_body",
]
