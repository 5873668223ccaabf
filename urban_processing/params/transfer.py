"""Parameters of `transfer`."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Annotated

from urban_processing.params.base import Naming, Param, Params


class Inherit(enum.StrEnum):
    """Which parcels with a new number take the columns of an old one."""

    NONE = "none"
    """None of them."""
    PART = "part"
    """Those that were a part of an old parcel, for more than half."""
    NEAREST = "nearest"
    """All in a block that was there before, from the parcel nearest by relative position."""


@dataclass(frozen=True, kw_only=True)
class TransferParams(Params):
    """Parameters of `transfer`."""

    columns: Annotated[
        str | None,
        Param(
            label="Columns to carry over",
            help="Columns of the parcels before that are carried over, separated by commas; by "
            "default all but those that measure a parcel.",
        ),
    ] = None
    inherit: Annotated[
        Inherit,
        Param(
            label="New parcels inherit",
            help="Which parcels with a new number take the columns of an old one too: none, those "
            "that were a part of it, or all, from the nearest by relative position.",
            labels={
                "none": "Nothing",
                "part": "From the parcel they were a part of",
                "nearest": "From the nearest parcel",
            },
        ),
    ] = Inherit.PART
    id_column: Annotated[
        str,
        Param(
            label="Column of parcel numbers",
            help="Column of the parcels before with their numbers; where it is missing, they are "
            "counted from 1.",
            advanced=True,
        ),
    ] = "parcel_id"
    block_column: Annotated[
        str,
        Param(
            label="Column of blocks",
            help="Column of a layer of parcels that says which of them are one block, used where "
            "no blocks are given.",
            advanced=True,
        ),
    ] = "block_id"

    def contradictions(self, called: Naming) -> list[str]:
        """Return what is wrong with the list of columns."""
        if self.columns is None or all(self.column_names):
            return []
        return [f"{called('columns')} must be names separated by commas; got {self.columns!r}."]

    @property
    def column_names(self) -> tuple[str, ...]:
        """Names of the columns asked for; none where all are meant."""
        if self.columns is None:
            return ()
        return tuple(name.strip() for name in self.columns.split(","))
