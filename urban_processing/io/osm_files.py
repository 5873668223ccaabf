"""Ways out of files of OpenStreetMap: XML, also compressed, and PBF."""

from __future__ import annotations

import bz2
import gzip
import lzma
import math
import tempfile
import zlib
from pathlib import Path
from typing import IO, Any, cast
from xml.parsers import expat

import numpy as np
import pyogrio
import shapely
from pyogrio.errors import DataLayerError, DataSourceError, FeatureError

from urban_processing.errors import BoundaryError
from urban_processing.intake.osm_lines import HIGHWAY
from urban_processing.io.osm_ways import TAGS, OsmWays, objects, ways_of
from urban_processing.progress import SILENT, Progress

CHUNK = 2**20
"""Bytes of XML that are parsed between two looks at whether the user stopped the run."""

_HEAD = 64
_CANNOT = "{path} cannot be read as OpenStreetMap data: {why}. Give an .osm file, also .osm.bz2 or "
_CANNOT += ".osm.gz, or an .osm.pbf file."


def read_ways(
    path: Path,
    *,
    near: tuple[float, float, float, float],
    progress: Progress = SILENT,
) -> OsmWays:
    """Read the ways with a ``highway`` from a file of OpenStreetMap.

    The format is told by the file's content. XML is parsed here: elements in any order,
    negative numbers of nodes that were never uploaded, and references to nodes that the file
    lacks are no hindrance. PBF is read by GDAL, which joins the nodes before and after those that
    are lacking by a straight line.

    Parameters
    ----------
    path
        The file.
    near
        West, south, east and north in degrees: ways whose bounds lie wholly outside are left out.
        Where this leaves none, all ways of the file are returned, so that the caller can say
        where they lie.
    progress
        Told how much of the file is read.

    Raises
    ------
    BoundaryError
        If the file is not there, is damaged or is none of OpenStreetMap.
    """
    if not path.exists():
        raise BoundaryError(f"The OpenStreetMap file {path} does not exist.")
    if path.is_dir():
        raise BoundaryError(f"{path} is a folder: give the OpenStreetMap file in it.")
    try:
        with path.open("rb") as raw:
            head = raw.read(_HEAD)
            raw.seek(0)
            if b"OSMHeader" not in head:
                ways = _read_xml(path, raw, head, progress)
                found = ways.near(near)
                return found if len(found) else ways
    except (OSError, EOFError, zlib.error, lzma.LZMAError) as error:
        reason = getattr(error, "strerror", None) or str(error).rstrip(".") or "it is damaged"
        raise BoundaryError(_CANNOT.format(path=path, why=reason)) from error
    progress.update(0.0, "Reading streets")
    found = _read_pbf(path, near)
    return found if len(found) else _read_pbf(path, None)


def _read_xml(path: Path, raw: IO[bytes], head: bytes, progress: Progress) -> OsmWays:
    """Parse XML, unpacked on the way."""
    stream: Any = raw
    if head.startswith(b"BZh"):
        stream = bz2.BZ2File(raw)
    elif head.startswith(b"\x1f\x8b"):
        stream = gzip.GzipFile(fileobj=raw)
    size = max(1, path.stat().st_size)
    parser = _Parser()
    try:
        while chunk := stream.read(CHUNK):
            parser.feed(chunk)
            progress.update(raw.tell() / size, "Reading streets")
        parser.close()
    except (expat.ExpatError, LookupError, ValueError) as error:  # the latter two: its encoding
        why = f"it is no XML, or damaged ({error})"
        raise BoundaryError(_CANNOT.format(path=path, why=why)) from error
    except _Foreign as error:
        raise BoundaryError(_CANNOT.format(path=path, why=error)) from error
    return parser.ways()


class _Foreign(Exception):
    """XML that is not OpenStreetMap's."""


class _Parser:
    """Collects nodes, and ways with a ``highway``, from OpenStreetMap's XML."""

    def __init__(self) -> None:
        self._expat = expat.ParserCreate()
        self._expat.StartElementHandler = self._first
        self._expat.EndElementHandler = self._end
        self._nodes: dict[str, tuple[float, float]] = {}
        self._ways: list[tuple[list[str], dict[str, str]]] = []
        self._refs: list[str] | None = None
        self._tags: dict[str, str] = {}

    def feed(self, chunk: bytes) -> None:
        self._expat.Parse(chunk, False)

    def close(self) -> None:
        self._expat.Parse(b"", True)

    def _first(self, name: str, _: dict[str, str]) -> None:
        if name != "osm":
            raise _Foreign(f"it is XML that begins with <{name}>")
        self._expat.StartElementHandler = self._start

    def _start(self, name: str, values: dict[str, str]) -> None:
        if name == "node":
            if "lon" in values and not _is_deleted(values):
                self._nodes[_needed(values, "id", name)] = _position(values)
        elif name == "way":
            self._refs = None if _is_deleted(values) else []
            self._tags = {}
        elif self._refs is not None:
            if name == "nd":
                self._refs.append(_needed(values, "ref", name))
            elif name == "tag" and _needed(values, "k", name) in TAGS:
                self._tags[values["k"]] = _needed(values, "v", name)

    def _end(self, name: str) -> None:
        if name == "way":
            if self._refs is not None and HIGHWAY in self._tags:
                self._ways.append((self._refs, self._tags))
            self._refs = None

    def ways(self) -> OsmWays:
        """Lines of the ways, in several pieces where nodes are lacking."""
        lines: list[shapely.LineString] = []
        tags: list[dict[str, str]] = []
        broken = 0
        for refs, known in self._ways:
            pieces: list[list[tuple[float, float]]] = [[]]
            for ref in refs:
                at = self._nodes.get(ref)
                if at is not None:
                    pieces[-1].append(at)
                elif pieces[-1]:
                    pieces.append([])
            broken += any(ref not in self._nodes for ref in refs)
            whole = [piece for piece in pieces if len(piece) > 1]
            lines += [shapely.LineString(piece) for piece in whole]
            tags += [known] * len(whole)
        return ways_of(lines, tags, broken)


def _is_deleted(values: dict[str, str]) -> bool:
    return values.get("visible") == "false" or values.get("action") == "delete"


def _needed(values: dict[str, str], key: str, element: str) -> str:
    """An attribute without which an element means nothing."""
    if key not in values:
        raise _Foreign(f"a <{element}> has no {key}")
    return values[key]


def _position(values: dict[str, str]) -> tuple[float, float]:
    try:
        at = float(values["lon"]), float(values["lat"])
    except (KeyError, ValueError) as error:
        raise _Foreign(f"node {values.get('id')} has no usable lon and lat") from error
    if not all(map(math.isfinite, at)):
        raise _Foreign(f"node {values.get('id')} has no usable lon and lat")
    return at


_CONFIG = f"""closed_ways_are_polygons=
attribute_name_laundering=no
report_all_nodes=no
report_all_ways=no
[points]
osm_id=no
[lines]
osm_id=no
attributes={",".join(TAGS)}
other_tags=no
[multipolygons]
osm_id=no
[multilinestrings]
osm_id=no
[other_relations]
osm_id=no
"""
"""What GDAL's driver is to read: lines and tags, closed ones without being made areas."""


def _read_pbf(path: Path, near: tuple[float, float, float, float] | None) -> OsmWays:
    with tempfile.TemporaryDirectory() as folder:
        config = Path(folder) / "osmconf.ini"
        config.write_text(_CONFIG, encoding="utf-8")
        options = {"CONFIG_FILE": str(config)}
        try:
            try:
                return _by_gdal(path, near, options)
            except FeatureError:
                # the driver's quick index wants nodes in order of their number
                return _by_gdal(path, near, options | {"USE_CUSTOM_INDEXING": "NO"})
        except (DataSourceError, DataLayerError, FeatureError) as error:
            why = f"it is damaged ({str(error).strip().splitlines()[0].rstrip('.')})"
            raise BoundaryError(_CANNOT.format(path=path, why=why)) from error


def _by_gdal(
    path: Path, near: tuple[float, float, float, float] | None, options: dict[str, str]
) -> OsmWays:
    meta, _, wkb, values = pyogrio.raw.read(
        path, layer="lines", where=f"{HIGHWAY} IS NOT NULL", bbox=near, force_2d=True, **options
    )
    known = dict(zip(meta["fields"].tolist(), values, strict=True))
    lines = cast(Any, shapely.from_wkb(wkb))
    blank = np.full(len(lines), "", dtype=object)
    tags = {name: objects([v or "" for v in known.get(name, blank)]) for name in TAGS}
    return OsmWays(np.asarray(lines, dtype=object), tags)
