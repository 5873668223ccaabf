"""Layouts from parcels and streets that were edited by hand, or come from elsewhere."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import shapely
from grid_layouts import boxes
from lands import LANDS, holed, site_of

import urban_processing as up
from urban_processing.assembly import assemble_layout
from urban_processing.errors import BoundaryError, TopologyError
from urban_processing.layout import Layout
from urban_processing.mesh.coverage import fit_together
from urban_processing.metrics import certificate
from urban_processing.metrics.tables import street_table
from urban_processing.params import CogenerateParams
from urban_processing.pipelines.cogenerate import cogenerate
from urban_processing.rebuild import canonical
from urban_processing.site import Frame

SNAP = 0.05


def pieces_of(layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    """Parcels and street lines of a layout in local metres."""
    lines = street_table(layout).geometry
    origin = np.asarray(layout.frame.origin)
    return layout.mesh.face_polygons(), shapely.transform(lines, lambda xy: xy - origin)


def shaken(polygons: np.ndarray, size: float, seed: int = 0) -> np.ndarray:
    """Every vertex of every polygon moved by itself."""
    rng = np.random.default_rng(seed)

    def ring(line: shapely.LinearRing) -> np.ndarray:
        xy = shapely.get_coordinates(line)[:-1]
        return xy + rng.uniform(-size, size, xy.shape)

    shapes = [shapely.Polygon(ring(p.exterior), [ring(r) for r in p.interiors]) for p in polygons]
    return np.array(shapes, dtype=object)


@pytest.fixture(scope="module")
def layouts() -> dict[str, Layout]:
    lands = {**{k: LANDS[k] for k in ("ellipse", "ell", "star")}, "ponds": holed(2)}
    return {
        name: cogenerate(site_of(land), CogenerateParams(parcels=60))
        for name, land in lands.items()
    }


@pytest.mark.parametrize("name", ["ellipse", "ell", "star", "ponds"])
def test_what_fits_stays_as_it_is(layouts: dict[str, Layout], name: str) -> None:
    layout = layouts[name]
    again = canonical(assemble_layout(*pieces_of(layout), frame=layout.frame, snap=SNAP))
    assert np.array_equal(again.mesh.xy, layout.mesh.xy)
    assert np.array_equal(again.mesh.next, layout.mesh.next)
    assert np.array_equal(again.edge_street, layout.edge_street)
    assert {i.code for i in again.issues} <= {"hole_between_parcels"}


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("name", ["ellipse", "ell", "star", "ponds"])
def test_shaken_parcels_are_fitted_together(
    layouts: dict[str, Layout], name: str, seed: int
) -> None:
    layout = layouts[name]
    parcels, streets = pieces_of(layout)
    fitted = assemble_layout(
        shaken(parcels, 0.012, seed),
        streets,
        frame=layout.frame,
        snap=SNAP,
        min_area=0.99 * layout.min_area,
    )
    fitted.mesh.validate()
    proof = certificate(fitted)
    assert proof.holds, [(c.name, c.message) for c in proof.failures]
    assert fitted.mesh.n_faces == layout.mesh.n_faces
    assert fitted.mesh.n_vertices == layout.mesh.n_vertices
    assert fitted.edge_street.sum() == layout.edge_street.sum()
    off = shapely.hausdorff_distance(fitted.mesh.face_polygons(), parcels)
    assert off.max() < SNAP


def test_a_vertex_of_one_is_led_into_the_edge_of_its_neighbour() -> None:
    below = shapely.box(0, 0, 40, 20)
    above = [shapely.box(0, 20.01, 20, 40), shapely.box(20, 20, 40, 40)]
    found = fit_together(np.array([below, *above], dtype=object), SNAP)
    assert shapely.coverage_is_valid(found.polygons)
    assert shapely.get_num_coordinates(found.polygons).tolist() == [6, 5, 5]
    assert len(found.overlaps) == len(found.gaps) == 0


def test_overlaps_gaps_and_pieces_are_told() -> None:
    # the second overlaps the first by a metre, the third cuts a strip out of the fourth
    parcels = [
        shapely.box(0, 0, 20, 20),
        shapely.box(19, 0, 40, 20),
        shapely.box(0, 30, 40, 32),
        shapely.box(0, 20, 40, 40),
        shapely.Polygon([(40, 0), (60, 0), (60, 40), (40, 40)], [[(45, 5), (50, 5), (50, 9)]]),
    ]
    layout = assemble_layout(
        np.array(parcels, dtype=object),
        np.array([shapely.LineString([(0, 0), (60, 0)])], dtype=object),
        frame=Frame(),
        snap=SNAP,
    )
    layout.mesh.validate()
    found = {i.code: i for i in layout.issues}
    assert set(found) == {"parcels_overlap", "hole_between_parcels", "parcel_in_pieces"}
    assert layout.mesh.n_faces == 6
    assert found["hole_between_parcels"].value == pytest.approx(10)
    assert sorted(round(i.value) for i in layout.issues if i.code == "parcels_overlap") == [20, 80]
    assert layout.mesh.face_area.sum() == pytest.approx(40 * 60 - 10)


def test_streets_that_run_along_no_boundary_are_told() -> None:
    parcels = np.array(boxes(2, 2), dtype=object)
    streets = np.array(
        [shapely.LineString([(0, 20.03), (40, 19.98)]), shapely.LineString([(5, 0), (5, 20)])],
        dtype=object,
    )
    layout = assemble_layout(parcels, streets, frame=Frame(), snap=SNAP)
    ys = layout.mesh.xy[layout.mesh.origin.reshape(-1, 2)[layout.edge_street]][:, :, 1]
    assert (ys == 20).all()
    assert float(layout.mesh.edge_length[layout.edge_street].sum()) == 40
    (issue,) = layout.issues
    assert issue.code == "street_off_boundaries"
    assert issue.value == pytest.approx(20, abs=3)


def test_a_street_that_ends_between_vertices_ends_there() -> None:
    parcels = np.array(boxes(2, 1), dtype=object)
    streets = np.array([shapely.LineString([(0, 0), (30, 0)])], dtype=object)
    layout = assemble_layout(parcels, streets, frame=Frame(), snap=SNAP)
    assert float(layout.mesh.edge_length[layout.edge_street].sum()) == 30


def test_parts_are_told_apart_and_sorted() -> None:
    parcels = np.array([*boxes(1, 1), *boxes(2, 2, at=(5, 5))], dtype=object)
    layout = assemble_layout(parcels, np.empty(0, dtype=object), frame=Frame(), snap=SNAP)
    assert layout.face_part.tolist() == [1, 0, 0, 0, 0]


def test_an_edited_file_can_be_optimized(tmp_path: Path, sample: Callable[[str], Path]) -> None:
    path = tmp_path / "layout.gpkg"
    made = up.cogenerate(sample("islington"), parcels=60, optimize=False)
    made.save(path)
    parcels = gpd.read_file(path, layer="parcels")
    # one parcel is cut in two by hand, another one drawn a little beside its place
    big = int(parcels.area.argmax())
    shape = parcels.geometry[big]
    x0, y0, x1, y1 = shape.bounds
    halves = shapely.ops.split(
        shape, shapely.LineString([(x0 - 9, (y0 + y1) / 2), (x1 + 9, (y0 + y1) / 2)])
    )
    geometry = parcels.geometry.to_list()
    geometry[big] = halves.geoms[0]
    other = (big + 5) % len(geometry)
    geometry[other] = shapely.affinity.translate(geometry[other], 0.02, 0.01)
    new = gpd.GeoDataFrame({"level": [None]}, geometry=[halves.geoms[1]], crs=parcels.crs)
    edited = gpd.GeoDataFrame(
        gpd.pd.concat([parcels.set_geometry(geometry), new], ignore_index=True), crs=parcels.crs
    )
    edited.to_file(path, layer="parcels")
    with pytest.raises((TopologyError, BoundaryError), match=r"edited|changed"):
        up.read_layout(path)
    better = up.optimize(path)
    assert len(better.parcels) == 61
    assert "layers_edited" in set(better.issues.code)
    assert list(better.provenance.algorithm) == ["cogenerate", "optimize"]
    failing = {check.name for check in better.certificate.failures}
    assert failing <= {"min_area", "reached"}  # the halves that were drawn


def test_layers_in_other_crs_are_brought_together(sample: Callable[[str], Path]) -> None:
    made = up.cogenerate(sample("ellipse"), parcels=40, optimize=False)
    plain = up.optimize(made)
    streets = made.streets.to_crs("EPSG:4326")
    layered = up.optimize(parcels=made.parcels, streets=streets)
    assert layered.certificate.holds
    assert layered.metric("streets") == plain.metric("streets")
    assert layered.metric("irregularity_mean") == pytest.approx(
        plain.metric("irregularity_mean"), rel=0.02
    )
    degrees = up.optimize(parcels=made.parcels.to_crs("EPSG:4326"), streets=streets)
    assert degrees.crs.is_projected
    assert "crs_changed" in set(degrees.issues.code)


def test_mistakes_with_layers_are_told() -> None:
    parcels = boxes(2, 1)
    street = shapely.LineString([(0, 0), (40, 0)])
    with pytest.raises(BoundaryError, match="Give a layout, or parcels and streets"):
        up.optimize(parcels=parcels)
    with pytest.raises(BoundaryError, match="Streets must be lines"):
        up.optimize(parcels=parcels, streets=[shapely.Point(0, 0)])
    with pytest.raises(BoundaryError, match="no polygon"):
        up.optimize(parcels=[street], streets=[street])
    frame = gpd.GeoDataFrame(geometry=parcels)
    with pytest.raises(BoundaryError, match="has no CRS"):
        up.optimize(parcels=frame, streets=[street])
