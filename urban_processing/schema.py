"""The one declaration of the layers and columns of a layout file.

The files, the frames, the styles and the documentation all read it from here.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass


class ColumnType(enum.StrEnum):
    """Type of the values of a column, named as numpy and pandas name it."""

    INTEGER = "int64"
    REAL = "float64"
    TEXT = "str"
    BOOLEAN = "bool"


class GeometryType(enum.StrEnum):
    """Geometry of a layer; `ANY` stands for points and polygons side by side."""

    NONE = ""
    POINT = "Point"
    LINE = "LineString"
    POLYGON = "Polygon"
    ANY = "Geometry"


@dataclass(frozen=True)
class Column:
    """One attribute of a layer.

    Parameters
    ----------
    name
        Name in files and tables, with its unit where it has one.
    dtype
        Type of the values.
    unit
        Unit of the values: ``m``, ``m²``, ``°``, ``s`` or nothing.
    description
        One sentence that says what the value means.
    alias
        Readable name for legends and forms.
    nullable
        Whether values may be missing.
    """

    name: str
    dtype: ColumnType
    unit: str
    description: str
    alias: str
    nullable: bool = False

    @property
    def label(self) -> str:
        """The readable name with the unit: ``Area [m²]``."""
        return f"{self.alias} [{self.unit}]" if self.unit else self.alias


@dataclass(frozen=True)
class Layer:
    """One layer of a layout file.

    Parameters
    ----------
    name
        Name in files.
    geometry
        Kind of its geometries.
    columns
        Its attributes in order.
    title
        Readable name.
    shown
        Whether a toolbox that makes single layers makes this one unless told otherwise.
    open
        Whether columns that somebody gave may follow: then the layer made is another `Layer` of
        the same name.
    """

    name: str
    geometry: GeometryType
    columns: tuple[Column, ...]
    title: str
    shown: bool = False
    open: bool = False

    @property
    def column_names(self) -> tuple[str, ...]:
        """Names of the columns in order."""
        return tuple(c.name for c in self.columns)

    def column(self, name: str) -> Column:
        """Return the column called `name`; `KeyError` if there is none."""
        for column in self.columns:
            if column.name == name:
                return column
        raise KeyError(f"Layer {self.name} has no column {name}.")


def _integer(name: str, alias: str, description: str, *, nullable: bool = False) -> Column:
    return Column(name, ColumnType.INTEGER, "", description, alias, nullable)


def _real(
    name: str, alias: str, description: str, *, unit: str = "", nullable: bool = False
) -> Column:
    return Column(name, ColumnType.REAL, unit, description, alias, nullable)


def _text(name: str, alias: str, description: str, *, nullable: bool = False) -> Column:
    return Column(name, ColumnType.TEXT, "", description, alias, nullable)


def _boolean(name: str, alias: str, description: str) -> Column:
    return Column(name, ColumnType.BOOLEAN, "", description, alias)


PART = _integer("part", "Part", "Connected piece of the land, counted from 0, largest first.")
BLOCK_ID = _integer("block_id", "Block", "Number of the block.")
_PART_OR_ALL = _integer(
    "part", "Part", "Connected piece of the land; empty where the whole is meant.", nullable=True
)
_PARCEL_ID = _integer("parcel_id", "Parcel", "Number of the parcel, counted from 1.")
_AREA = _real("area_m2", "Area", "Area, to the centreline of streets.", unit="m²")

PARCELS = Layer(
    "parcels",
    GeometryType.POLYGON,
    (
        _PARCEL_ID,
        PART,
        _integer("level", "Level", "Number of cuts that made the parcel out of its part."),
        _AREA,
        _real(
            "net_area_m2",
            "Net area",
            "Area less right-of-way; empty where no right-of-way is laid out.",
            unit="m²",
            nullable=True,
        ),
        _integer("sides", "Sides", "Number of sides of the approximate polygon."),
        _real(
            "irregularity",
            "Irregularity",
            "Irregularity of the approximate polygon (Chen 2024, Eq. 1); 0 for a square.",
        ),
        _real("frontage_m", "Frontage", "Length of the boundary on street centrelines.", unit="m"),
        _real(
            "width_m",
            "Width",
            "Extent along the street side with the longest frontage; empty without frontage.",
            unit="m",
            nullable=True,
        ),
        _real(
            "depth_m",
            "Depth",
            "Extent across the street side with the longest frontage; empty without frontage.",
            unit="m",
            nullable=True,
        ),
        _real(
            "thinness",
            "Thinness",
            "Diameter of the largest inscribed circle over the square root of the area: "
            "1 for a square, 0.71 for 1:2, 0.5 for 1:4.",
        ),
        _boolean("rim", "Rim parcel", "Whether an edge lies on the land's rim or an obstacle."),
        _text(
            "land_use",
            "Land use",
            "Use of the parcel: parcel, that of the locked land given, or remnant for what streets "
            "leave too small.",
        ),
        _boolean("locked", "Locked", "Whether the parcel is not to be cut."),
        _boolean(
            "reached",
            "Reached",
            "Whether the frontage is at least 3 m, or a quarter of the square root of the area "
            "where that is less.",
        ),
        _boolean("through_lot", "Through lot", "Whether two opposite sides have frontage."),
        _real(
            "p_angle_deg",
            "Angle deviation",
            "Mean deviation of the corners from 90° (Yang 2013).",
            unit="°",
        ),
        _real(
            "p_area",
            "Rectangle ratio",
            "Area of the smallest rotated rectangle around the parcel over its own (Yang 2013).",
        ),
        _text("lineage", "Lineage", "Path in the tree of cuts, hashed to 16 hexadecimal digits."),
        _text(
            "stage",
            "Stage",
            "Whether co-generation goes on with the parcel: done; open, to be cut at the next "
            "level if it is large enough; ahead, if it has its cut of that level already; behind, "
            "if a cut that it had was undone.",
        ),
        _integer(
            "quota",
            "Quota",
            "Number of parcels that it is still to become; empty where no number was given.",
            nullable=True,
        ),
    ),
    "Parcels",
    shown=True,
)

STEERING_COLUMNS = ("stage", "quota")
"""Columns of parcels that only a layout in the making needs."""

STREETS = Layer(
    "streets",
    GeometryType.LINE,
    (
        _integer("edge_id", "Edge", "Number of the network edge, counted from 1."),
        _integer("street_id", "Street", "Number of the street that the edge belongs to."),
        PART,
        _text(
            "class",
            "Class",
            "rim, collector, local or cul_de_sac; of a given street its own, or else fixed.",
        ),
        _integer(
            "level",
            "Level",
            "Level at which the street was laid out; 0 for the rim and for given streets.",
        ),
        _real("width_m", "Width", "Nominal width of the right-of-way.", unit="m"),
        _real("length_m", "Length", "Length of the centreline.", unit="m"),
        _integer(
            "from_junction", "From", "Junction or end at its start; none on a ring.", nullable=True
        ),
        _integer("to_junction", "To", "Junction or end at its end; none on a ring.", nullable=True),
        _integer(
            "fixed_id",
            "Given street",
            "Number of the given street that it lies on, counted from 1; empty for all others.",
            nullable=True,
        ),
    ),
    "Streets",
    shown=True,
)

JUNCTIONS = Layer(
    "junctions",
    GeometryType.POINT,
    (
        _integer("junction_id", "Junction", "Number of the junction or end, counted from 1."),
        PART,
        _text("kind", "Kind", "junction, end or entry."),
        _integer("degree", "Degree", "Number of street edges that meet."),
        _real(
            "angle_dev_deg",
            "Angle deviation",
            "Mean deviation from 90° of the angles between its streets; empty for an end.",
            unit="°",
            nullable=True,
        ),
    ),
    "Junctions and street ends",
    shown=True,
)

BOUNDARY = Layer(
    "boundary",
    GeometryType.POLYGON,
    (PART, _AREA),
    "Land that was laid out",
)

INPUT_BOUNDARY = Layer("input_boundary", GeometryType.POLYGON, (PART, _AREA), "Boundary as given")

OBSTACLES = Layer("obstacles", GeometryType.POLYGON, (PART, _AREA), "Obstacles")

TRUE_AREA = _real("area_m2", "Area", "Area.", unit="m²")

RIGHT_OF_WAY = Layer(
    "right_of_way",
    GeometryType.POLYGON,
    (
        _text(
            "class",
            "Class",
            "Class of its streets: rim, fixed, collector, local, cul_de_sac, or one given.",
        ),
        PART,
        TRUE_AREA,
    ),
    "Right-of-way",
)

NET_PARCELS = Layer(
    "net_parcels", GeometryType.POLYGON, (_PARCEL_ID, PART, TRUE_AREA), "Net parcels"
)

_STREET_ID = _integer(
    "street_id",
    "Street",
    "Number of the street along it: that given, or streets of one name or in one line.",
    nullable=True,
)

BLOCKS = Layer(
    "blocks",
    GeometryType.POLYGON,
    (
        BLOCK_ID,
        PART,
        TRUE_AREA,
        _real("perimeter_m", "Perimeter", "Length of all its edges.", unit="m"),
        _real("frontage_m", "Frontage", "Length of its edges on streets.", unit="m"),
        _integer("streets", "Streets", "Number of streets around it."),
    ),
    "Blocks",
    shown=True,
)
"""Land between streets, net of rights-of-way."""

BLOCK_EDGES = Layer(
    "block_edges",
    GeometryType.LINE,
    (
        BLOCK_ID,
        PART,
        _STREET_ID,
        _text("class", "Class", "Class of the street; empty where there is none.", nullable=True),
        _real(
            "width_m",
            "Width",
            "Width of the right-of-way of the street; empty where there is none.",
            unit="m",
            nullable=True,
        ),
        _real("length_m", "Length", "Length of the edge.", unit="m"),
        _boolean("access", "Access", "Whether a street lies along it."),
    ),
    "Edges of blocks",
    shown=True,
)
"""Edges of blocks with the street along them; those that follow one another on one are one."""

ISSUES = Layer(
    "issues",
    GeometryType.ANY,
    (
        _PART_OR_ALL,
        _integer("parcel_id", "Parcel", "Parcel that is meant, if a single one.", nullable=True),
        _text("code", "Code", "Kind of issue, for programs."),
        _text("message", "Message", "What could not be done or should be known."),
        _real("value", "Value", "Measured value, where there is one.", nullable=True),
        _real("limit", "Limit", "Value that was to be kept.", nullable=True),
    ),
    "Issues",
    shown=True,
)

METRICS = Layer(
    "metrics",
    GeometryType.NONE,
    (
        _PART_OR_ALL,
        _text("metric", "Metric", "Name of the metric."),
        _real("value", "Value", "Value; empty where it is not defined.", nullable=True),
        _text("unit", "Unit", "Unit of the value; nothing for numbers and ratios."),
    ),
    "Metrics",
)

PROVENANCE = Layer(
    "provenance",
    GeometryType.NONE,
    (
        _integer("step", "Step", "Number of the step, counted from 1."),
        _text("algorithm", "Algorithm", "Name of the algorithm."),
        _text("parameters", "Parameters", "Parameters as JSON."),
        _integer("seed", "Seed", "Random seed."),
        _text("version", "Version", "Version of the software."),
        _text("input_sha256", "Input hash", "SHA-256 of the input."),
        Column("seconds", ColumnType.REAL, "s", "Time that the step took.", "Seconds"),
        _text("results", "Results", "Figures that the step has to tell, as JSON."),
        _PART_OR_ALL,
    ),
    "Provenance",
)

LAYERS: tuple[Layer, ...] = (
    PARCELS,
    STREETS,
    JUNCTIONS,
    BOUNDARY,
    INPUT_BOUNDARY,
    OBSTACLES,
    RIGHT_OF_WAY,
    NET_PARCELS,
    ISSUES,
    METRICS,
    PROVENANCE,
)
"""All layers, in the order in which a file lists them."""

LAID_OUT: tuple[Layer, ...] = LAYERS
"""Layers that a layout can have at present."""

_BY_NAME = {layer.name: layer for layer in LAYERS}


def layer(name: str) -> Layer:
    """Return the layer called `name`; `KeyError` if there is none.

    >>> layer("junctions").column("angle_dev_deg").unit
    '°'
    """
    return _BY_NAME[name]
