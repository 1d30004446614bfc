"""Materials of links: a TOML file in engineering units, converted to SI."""

from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Annotated

from pydantic import Field

from boom_model.provenance import Basis, BasisName, Origin
from boom_model.toml_file import Positive, Table, read_toml
from boom_model.words import unknown

MATERIALS_FILE = Path(str(files("boom_model") / "data" / "materials.toml"))


@dataclass(frozen=True)
class Material:
    """An isotropic material."""

    name: str
    elastic_modulus: float
    """E [Pa]"""
    density: float
    """[kg/m^3]"""
    yield_stress: float
    """[Pa]"""
    poisson_ratio: float
    origin: Origin

    @property
    def shear_modulus(self) -> float:
        """Shear modulus G = E / (2 (1 + nu)) [Pa]."""
        return self.elastic_modulus / (2.0 * (1.0 + self.poisson_ratio))

    @staticmethod
    def load(name: str, path: str | Path | None = None) -> "Material":
        """Load a material of a TOML file by name.

        If path is None, load it from the shipped `boom_model/data/materials.toml`.

        Raises:
            InputError: unknown material, or a file that cannot be read or has the wrong form. The
                message names the key.
        """
        known = read_toml(MATERIALS_FILE if path is None else Path(path), _MaterialsTable).materials
        if name not in known:
            raise unknown("material", name, sorted(known))
        t = known[name]
        return Material(
            name=name,
            elastic_modulus=t.elastic_modulus_GPa * 1e9,
            density=t.density_kg_m3,
            yield_stress=t.yield_stress_MPa * 1e6,
            poisson_ratio=t.poisson_ratio,
            origin=Origin(Basis(t.basis), t.source),
        )


class _MaterialTable(Table):
    elastic_modulus_GPa: Positive
    density_kg_m3: Positive
    yield_stress_MPa: Positive
    poisson_ratio: Annotated[float, Field(ge=0, lt=0.5, allow_inf_nan=False)]
    basis: BasisName
    source: str


class _MaterialsTable(Table):
    materials: dict[str, _MaterialTable] = Field(default_factory=dict)
