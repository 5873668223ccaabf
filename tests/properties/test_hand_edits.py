"""What holds for every layout that somebody edited by hand, whatever was done to it."""

from __future__ import annotations

from collections import Counter

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

import urban_processing as up
from urban_processing.io.frames import GeoLayout
from urban_processing.io.layouts import read_layers
from urban_processing.layout import Layout, Stage
from urban_processing.metrics import certificate
from urban_processing.params import OptimizeParams
from urban_processing.params.resume import ResumeParams
from urban_processing.pipelines.hand_edits import edits_listed
from urban_processing.pipelines.optimize import optimize
from urban_processing.pipelines.resume import resume

SNAP = 0.05
edits = st.lists(
    st.tuples(
        st.sampled_from(["move", "shake", "split", "merge", "delete street", "use", "lock"]),
        st.integers(0, 2**16),
    ),
    min_size=1,
    max_size=5,
)


@pytest.fixture(scope="module")
def stage() -> GeoLayout:
    land = shapely.Polygon([(0, 0), (420, 0), (400, 260), (180, 300), (-20, 220)])
    return up.cogenerate(land, crs="EPSG:32630", parcels=60, stop_at_level=4)


class Desk:
    """Layers as somebody edits them, and what is to come of them."""

    def __init__(self, layout: GeoLayout) -> None:
        self.parcels = layout.parcels.reset_index(drop=True)
        self.streets = layout.streets.reset_index(drop=True)
        self.n = Counter[str]()

    def edit(self, what: str, number: int) -> None:
        rng = np.random.default_rng(number)
        row = int(rng.integers(len(self.parcels)))
        done = getattr(self, f"_{what.replace(' ', '_')}")(row, rng)
        self.n[what] += done

    def _set(self, row: int, shape: shapely.Polygon) -> None:
        self.parcels.loc[row, "geometry"] = shape

    def _move(self, row: int, rng: np.random.Generator) -> bool:
        """A corner inside the land, with all that meets there, as topological editing does."""
        xy = shapely.get_coordinates(self.parcels.geometry[row])
        place = xy[rng.integers(len(xy))]
        land = shapely.union_all(self.parcels.geometry.to_numpy())
        if land.exterior.distance(shapely.Point(place)) < 12:
            return False
        step = rng.uniform(-3, 3, 2)

        def moved(xy: np.ndarray) -> np.ndarray:
            return xy + (np.hypot(*(xy - place).T) < SNAP)[:, None] * step

        layers = [self.parcels, self.streets]
        shapes = [shapely.transform(layer.geometry.to_numpy(), moved) for layer in layers]
        if not shapely.is_valid(shapes[0]).all():
            return False
        if abs(shapely.area(shapes[0]).sum() - land.area) > 1e-6 * land.area:
            return False
        for layer, shape in zip(layers, shapes, strict=True):
            layer["geometry"] = gpd.GeoSeries(shape, crs=layer.crs)
        return True

    def _shake(self, row: int, rng: np.random.Generator) -> bool:
        """A parcel that is a little beside its place."""
        step = rng.uniform(-0.015, 0.015, 2)
        shape = self.parcels.geometry[row]
        self._set(row, shapely.transform(shape, lambda xy: xy + step))
        return True

    def _split(self, row: int, rng: np.random.Generator) -> bool:
        shape = self.parcels.geometry[row]
        centre = np.array(shape.centroid.coords[0])
        turn = rng.uniform(0, np.pi)
        way = 500 * np.array([np.cos(turn), np.sin(turn)])
        parts = shapely.ops.split(shape, shapely.LineString([centre - way, centre + way])).geoms
        if len(parts) != 2 or min(part.area for part in parts) < 50:
            return False
        other = self.parcels.iloc[[row]].set_geometry([parts[1]], crs=self.parcels.crs)
        self.parcels = gpd.GeoDataFrame(
            pd.concat([self.parcels, other], ignore_index=True), crs=self.parcels.crs
        )
        self._set(row, parts[0])
        return True

    def _merge(self, row: int, rng: np.random.Generator) -> bool:
        shapes = self.parcels.geometry
        shared = shapes.intersection(shapes[row]).length.drop(row)
        joined = shapely.union(shapes[row], shapes[shared.idxmax()])
        if shared.max() < 5 or joined.geom_type != "Polygon" or len(joined.interiors):
            return False
        self._set(row, joined)
        self.parcels = self.parcels.drop(index=shared.idxmax()).reset_index(drop=True)
        return True

    def _delete_street(self, row: int, rng: np.random.Generator) -> bool:
        inner = self.streets.index[self.streets["class"] != "rim"]
        if not len(inner):
            return False
        self.streets = self.streets.drop(index=rng.choice(inner)).reset_index(drop=True)
        return True

    def _use(self, row: int, rng: np.random.Generator) -> bool:
        self.parcels.loc[row, "land_use"] = rng.choice(["park", "school", "parcel"])
        return True

    def _lock(self, row: int, rng: np.random.Generator) -> bool:
        self.parcels.loc[row, "locked"] = True
        return True


def faces_of(layout: Layout, rows: gpd.GeoDataFrame) -> tuple[gpd.GeoDataFrame, gpd.GeoDataFrame]:
    """Parcels of a layout by the columns of files, and the row that each lies in."""
    faces = gpd.GeoDataFrame(
        {
            "level": layout.face_level,
            "lineage": [f"{value:016x}" for value in layout.face_lineage.tolist()],
            "locked": layout.face_locked,
            "land_use": [layout.land_uses[i] for i in layout.face_use.tolist()],
            "stage": [Stage(value).name.lower() for value in layout.face_stage.tolist()],
            "quota": layout.face_quota,
        },
        geometry=layout.mesh.face_polygons(layout.frame.origin),
        crs=rows.crs,
    )
    points = faces.set_geometry(faces.representative_point())[["geometry"]]
    found = gpd.sjoin(points, rows[["geometry"]], predicate="within")["index_right"].sort_index()
    assert sorted(found) == list(range(len(rows)))
    return faces, rows.iloc[found].reset_index(drop=True)


def edited(stage: GeoLayout, done: list[tuple[str, int]]) -> tuple[Layout, Desk]:
    desk = Desk(stage)
    for edit in done:
        desk.edit(*edit)
    layout = read_layers(desk.parcels, desk.streets, snap=SNAP, before=stage.layout)
    return layout, desk


@given(done=edits)
@settings(max_examples=25, deadline=None)
def test_every_edit_gives_a_layout_whose_parcels_are_what_their_rows_say(
    stage: GeoLayout, done: list[tuple[str, int]]
) -> None:
    layout, desk = edited(stage, done)
    layout.mesh.validate()
    assert shapely.coverage_is_valid(layout.mesh.face_polygons())
    land = stage.layout.mesh.face_area.sum()
    shaken = 0.01 + 8 * desk.n["shake"]  # a parcel at the rim, along it
    assert layout.mesh.face_area.sum() == pytest.approx(land, abs=shaken)
    told = {issue.code for issue in layout.issues}
    # parcels may be merged across a street
    assert told <= {"stopped"} | ({"street_off_boundaries"} if desk.n["merge"] else set())

    parcels, rows = faces_of(layout, desk.parcels)
    for name in ("land_use", "locked", "stage"):
        assert parcels[name].tolist() == rows[name].tolist(), name
    assert parcels.lineage.is_unique
    split = rows.lineage.map(rows.lineage.value_counts()) > 1
    assert (parcels.level - rows.level).tolist() == split.astype(int).tolist()
    for name in ("lineage", "quota"):
        assert parcels[name][~split].tolist() == rows[name][~split].tolist()
    assert not set(parcels.lineage[split]) & set(rows.lineage)
    for _, pieces in parcels[split].groupby(rows.lineage[split]):
        of = rows.quota[pieces.index[0]]
        assert pieces.quota.sum() == max(of, len(pieces))

    steered = layout.edge_level[layout.edge_street]
    assert set(steered.tolist()) <= set(stage.layout.edge_level[stage.layout.edge_street].tolist())
    listed, changes = edits_listed(stage.layout, layout)
    assert listed.issues[-1].code == "edited_since"
    table = changes.table("changes")
    new = {int(n) for n in table["new_id"] if n == n}
    assert new == set(range(1, layout.mesh.n_faces + 1))
    assert {int(n) for n in table["old_id"] if n == n} == set(range(1, 17))
    if desk.n["split"] + desk.n["merge"] == 0:
        assert set(table["change"]) <= {"kept", "moved"}
        assert (table["old_id"] == table["new_id"]).all()


@given(done=edits)
@settings(max_examples=4, deadline=None)
def test_one_goes_on_with_every_edited_layout(
    stage: GeoLayout, done: list[tuple[str, int]]
) -> None:
    layout, _ = edited(stage, done)
    final = resume(layout, ResumeParams())
    smooth = optimize(layout, OptimizeParams())
    # halves drawn too small stay so; to connect all by streets is the work of going on
    missed = {check.name for check in certificate(final).failures}
    assert missed <= {"min_area"}
    missed = {check.name for check in certificate(smooth).failures}
    assert missed <= {"min_area", "reached", "streets_connected"}
    assert final.mesh.n_faces > layout.mesh.n_faces
    assert smooth.mesh.n_faces == layout.mesh.n_faces
    locked = layout.face_lineage[layout.face_locked]
    assert np.isin(locked, final.face_lineage).all()
