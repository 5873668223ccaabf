"""Classes of streets, how wide each is, and how rights-of-way are laid out."""

from __future__ import annotations

import dataclasses
import enum
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Self


class StreetClass(enum.StrEnum):
    """Class of a network edge, from the highest to the lowest."""

    RIM = "rim"
    FIXED = "fixed"
    COLLECTOR = "collector"
    LOCAL = "local"
    CUL_DE_SAC = "cul_de_sac"


@dataclass(frozen=True, kw_only=True)
class StreetRules:
    """What a layout's streets are to be, besides where they run; lengths in metres.

    Parameters
    ----------
    rim, fixed, collector, local, cul_de_sac
        Nominal width of the right-of-way of each `StreetClass`, from side to side. Streets on
        the rim of the land take only their inner half from it.
    corner_radius
        Radius that rounds the corners of blocks at junctions.
    turning_radius
        Radius of the turning heads at dead ends; 0 for none.
    laid_out
        Whether rights-of-way are cut out of the parcels.
    net_min_area
        Whether the smallest parcel allowed is a net area, less right-of-way.
    """

    rim: float = 16.0
    fixed: float = 16.0
    collector: float = 16.0
    local: float = 12.0
    cul_de_sac: float = 10.0
    corner_radius: float = 6.0
    turning_radius: float = 9.0
    laid_out: bool = False
    net_min_area: bool = False

    @property
    def width_m(self) -> Mapping[str, float]:
        """Nominal width by class."""
        return MappingProxyType({c.value: float(getattr(self, c.value)) for c in StreetClass})

    def as_dict(self) -> dict[str, Any]:
        """Return the rules as plain JSON types."""
        return dataclasses.asdict(self)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the rules that `as_dict` gave; what is not there is as by default."""
        known = {field.name for field in dataclasses.fields(cls)}
        return cls(**{name: value for name, value in values.items() if name in known})
