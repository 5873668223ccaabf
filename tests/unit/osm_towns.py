"""Small towns as files of OpenStreetMap, drawn in metres."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import pyproj
import shapely

from urban_processing.io.boundaries import read_boundary
from urban_processing.site import Site

CRS = "EPSG:32633"
EAST, NORTH = 500_000.0, 5_300_000.0

XY = tuple[float, float]


@lru_cache
def _to_degrees() -> pyproj.Transformer:
    return pyproj.Transformer.from_crs(CRS, "EPSG:4326", always_xy=True)


def degrees(x: float, y: float) -> XY:
    """Longitude and latitude of a place in the town."""
    lon, lat = _to_degrees().transform(EAST + x, NORTH + y)
    return round(lon, 8), round(lat, 8)


def land(x0: float, y0: float, x1: float, y1: float) -> Site:
    """A rectangle of land in the town."""
    return read_boundary(shapely.box(EAST + x0, NORTH + y0, EAST + x1, NORTH + y1), crs=CRS)


@dataclass
class Town:
    """Ways through places in metres; ways meet where they name the same place."""

    ways: list[tuple[list[XY], dict[str, str]]] = field(default_factory=list)
    missing: set[XY] = field(default_factory=set)

    def way(self, *places: XY, highway: str = "residential", **tags: str) -> Town:
        """Add a way."""
        self.ways.append((list(places), {"highway": highway} | tags))
        return self

    def grid(self, n: int = 4, step: float = 200.0) -> Town:
        """Add n streets each way, from 0 to (n - 1) step."""
        at = [i * step for i in range(n)]
        for a in at:
            self.way(*[(x, a) for x in at], name=f"Row {a:g}")
            self.way(*[(a, y) for y in at], name=f"Column {a:g}")
        return self

    def numbers(self) -> dict[XY, int]:
        """The number of the node at each place."""
        places = dict.fromkeys(place for places, _ in self.ways for place in places)
        return {place: i + 1 for i, place in enumerate(places)}

    def xml(self, *, seed: int | None = None, sign: int = 1, ways_first: bool = False) -> str:
        """The file's text; with a seed the order and direction of all there is are changed."""
        number = self.numbers()
        nodes = []
        for place, i in number.items():
            if place not in self.missing:
                lon, lat = degrees(*place)
                nodes.append(f'<node id="{sign * i}" lat="{lat}" lon="{lon}" version="1"/>')
        ways, chance = [], random.Random(seed)
        for i, (places, tags) in enumerate(self.ways):
            if seed is not None and chance.random() < 0.5:
                places = places[::-1]
            refs = "".join(f'<nd ref="{sign * number[place]}"/>' for place in places)
            told = "".join(f'<tag k="{key}" v="{value}"/>' for key, value in tags.items())
            ways.append(f'<way id="{sign * (i + 1)}" version="1">{refs}{told}</way>')
        if seed is not None:
            chance.shuffle(nodes)
            chance.shuffle(ways)
        body = [*ways, *nodes] if ways_first else [*nodes, *ways]
        return '<?xml version="1.0"?>\n<osm version="0.6">\n' + "\n".join(body) + "\n</osm>\n"

    def write(self, path: Path, **options: Any) -> Path:
        """Write the file."""
        path.write_text(self.xml(**options), encoding="utf-8")
        return path

    def overpass(self) -> dict[str, Any]:
        """What an Overpass server answers."""
        number = self.numbers()
        elements: list[dict[str, Any]] = [
            {"type": "node", "id": i, "lon": degrees(*place)[0], "lat": degrees(*place)[1]}
            for place, i in number.items()
        ]
        for i, (places, tags) in enumerate(self.ways):
            refs = [number[place] for place in places]
            elements.append({"type": "way", "id": i + 1, "nodes": refs, "tags": tags})
        return {"version": 0.6, "elements": elements}


def circle(x: float, y: float, radius: float, n: int = 12) -> list[XY]:
    """Places around a centre, the first one in the east; not closed."""
    turn = [2 * math.pi * i / n for i in range(n)]
    return [(x + round(radius * math.cos(a), 6), y + round(radius * math.sin(a), 6)) for a in turn]


def avenue_town() -> Town:
    """A grid of streets with a dual carriageway between its second and its third row."""
    town = Town()
    xs, rows = (0.0, 200.0, 400.0, 600.0), (0.0, 200.0, 400.0, 600.0)
    for y in rows:
        town.way(*[(x, y) for x in xs], name=f"Row {y:g}")
    for x in xs:
        ys = sorted([*rows, 294.0, 306.0])
        town.way(*[(x, y) for y in ys], name=f"Column {x:g}")
    for y in (294.0, 306.0):
        places = [(-300.0, 300.0), *[(x, y) for x in xs], (900.0, 300.0)]
        town.way(*places, highway="secondary", name="Avenue", lanes="2", oneway="yes")
    for x in (-300.0, 900.0):
        town.way((x, 300.0), (x + (x - 300.0) / 4, 300.0), highway="secondary", name="Avenue")
    return town


def roundabout_town() -> Town:
    """A grid of streets with a roundabout in its middle."""
    ring = circle(200.0, 200.0, 15.0)
    town = Town()
    for a in (0.0, 400.0):
        town.way((0.0, a), (200.0, a), (400.0, a)).way((a, 0.0), (a, 200.0), (a, 400.0))
    arms = ((400.0, 200.0), (200.0, 400.0), (0.0, 200.0), (200.0, 0.0))
    for arm, place in zip(arms, ring[::3], strict=True):
        town.way(place, arm)
    return town.way(*ring, ring[0], junction="roundabout", highway="tertiary", oneway="yes")


def slip_road_town() -> Town:
    """A grid of streets with a slip road that cuts a corner."""
    town = Town()
    for a in (0.0, 400.0):
        town.way((0.0, a), (200.0, a), (400.0, a)).way((a, 0.0), (a, 200.0), (a, 400.0))
    town.way((0.0, 200.0), (175.0, 200.0), (200.0, 200.0), (400.0, 200.0), highway="primary")
    town.way((200.0, 0.0), (200.0, 175.0), (200.0, 200.0), (200.0, 400.0))
    return town.way((175.0, 200.0), (190.0, 190.0), (200.0, 175.0), highway="primary_link")
