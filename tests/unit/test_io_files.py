"""Layout files: what was written is what is read, and nothing is lost on the way."""

from __future__ import annotations

import dataclasses
import hashlib
import sqlite3
import time
import xml.etree.ElementTree as ET
from contextlib import closing
from pathlib import Path

import geopandas as gpd
import numpy as np
import pyogrio
import pytest
import shapely
from grid_layouts import boxes, layout_of

from urban_processing.errors import BoundaryError, OutputError, ParameterError, TopologyError
from urban_processing.io.exports import check_export, export_layout
from urban_processing.io.files import read_layout, write_layout
from urban_processing.io.frames import GeoLayout
from urban_processing.layout import Layout
from urban_processing.layout_file import files
from urban_processing.layout_file.files import as_written
from urban_processing.layout_file.writing import check_output
from urban_processing.metrics.tables import layout_tables
from urban_processing.provenance import Step
from urban_processing.rebuild import canonical
from urban_processing.schema import LAYERS, GeometryType
from urban_processing.site import GRID, Frame, Issue
from urban_processing.tables import Table

ORIGIN = (690_423.0, 5_700_151.0)


@pytest.fixture
def layout() -> Layout:
    """Two parts, one with a hole, off the whole metres, with issues of every kind."""
    cells = boxes(4, 4, without=[(1, 1), (2, 1)]) + boxes(2, 2, at=(6, 0))
    shaken = np.random.default_rng(1)
    corners = np.unique(shapely.get_coordinates(cells), axis=0)
    moved = {tuple(c): np.round((c + shaken.uniform(-3, 3, 2)) / GRID) * GRID for c in corners}
    polygons = [
        shapely.Polygon([moved[x, y] for x, y in shapely.get_coordinates(c)]) for c in cells
    ]
    part = [0] * 14 + [1] * 4
    plain = layout_of(polygons, part=part, origin=ORIGIN)
    inside = ~plain.mesh.edge_is_boundary
    street = plain.edge_street | (inside & (np.arange(plain.mesh.n_edges) % 3 == 0))
    n = plain.mesh.n_faces
    return plain.replace(
        edge_street=street,
        edge_level=np.where(plain.edge_street, 0, np.where(street, 2, -1)).astype(np.int16),
        vertex_corner=np.arange(plain.mesh.n_vertices) % 5 == 0,
        face_level=np.arange(n) % 4,
        face_lineage=np.arange(n, dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15),
        face_locked=np.arange(n) % 7 == 0,
        issues=(
            Issue("at_a_point", "é", 0, 3, 1.5, 2.0, shapely.Point(3.3, 4.4)),
            Issue("nowhere", "No place."),
            Issue("area", "An area.", part=1, geometry=polygons[1]),
        ),
        history=(Step("cogenerate", {"min_area": 400.0, "x": None}, 7, "0.1", "ab" * 32, 1.25),),
        input_parts=tuple(shapely.union_all(polygons[i:j]) for i, j in ((0, 14), (14, 18))),
    )


def assert_same(one: Table, other: Table) -> None:
    assert list(one.columns) == list(other.columns)
    for name, values in one.columns.items():
        np.testing.assert_array_equal(values, other[name], err_msg=name)
    if one.geometry is not None:
        assert other.geometry is not None
        for a, b in zip(one.geometry, other.geometry, strict=True):
            assert (a is None) == (b is None)
            assert a is None or a.equals_exact(b)


def digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_every_layer_comes_back_exactly(layout: Layout, tmp_path: Path) -> None:
    path = write_layout(layout, tmp_path / "a.gpkg")
    read = read_layout(path)
    written = layout_tables(as_written(layout))
    assert list(read.tables) == list(written)
    for name, table in written.items():
        assert_same(table, read.tables[name])


def test_the_mesh_and_its_attributes_come_back(layout: Layout, tmp_path: Path) -> None:
    expected = canonical(layout)
    read = read_layout(write_layout(layout, tmp_path / "a.gpkg", record_seconds=True)).layout
    for name in ("xy", "origin", "next", "face"):
        np.testing.assert_array_equal(getattr(read.mesh, name), getattr(expected.mesh, name))
    for field in dataclasses.fields(Layout):
        if field.name in ("mesh", "issues", "input_parts", "history", "min_area", "frame"):
            continue
        np.testing.assert_array_equal(
            getattr(read, field.name), getattr(expected, field.name), err_msg=field.name
        )
    assert read.frame == expected.frame
    assert read.min_area == expected.min_area
    assert read.history == expected.history
    assert [i.code for i in read.issues] == [i.code for i in expected.issues]


def test_canonical_changes_nothing_but_numbers(layout: Layout) -> None:
    rebuilt = canonical(layout)
    rebuilt.mesh.validate()
    assert rebuilt.vertex_corner.sum() == layout.vertex_corner.sum()
    assert rebuilt.edge_street.sum() == layout.edge_street.sum()
    assert all(
        a.equals(b)
        for a, b in zip(rebuilt.mesh.face_polygons(), layout.mesh.face_polygons(), strict=True)
    )
    again = canonical(rebuilt)
    np.testing.assert_array_equal(again.mesh.origin, rebuilt.mesh.origin)
    np.testing.assert_array_equal(again.mesh.xy, rebuilt.mesh.xy)


def test_same_layout_gives_same_bytes(layout: Layout, tmp_path: Path) -> None:
    first = write_layout(layout, tmp_path / "a.gpkg")
    slower = layout.replace(history=(dataclasses.replace(layout.history[0], seconds=99.0),))
    time.sleep(1.1)
    assert digest(first) == digest(write_layout(slower, tmp_path / "other name.gpkg"))
    timed = write_layout(layout, tmp_path / "c.gpkg", record_seconds=True)
    assert digest(first) != digest(timed)
    assert pyogrio.get_gdal_config_option("OGR_CURRENT_DATE") is None


def test_layers_and_columns_follow_the_schema(layout: Layout, tmp_path: Path) -> None:
    path = write_layout(layout, tmp_path / "a.gpkg")
    found = pyogrio.list_layers(path)
    names = [layer.name for layer in LAYERS if layer.name in set(found[:, 0])]
    assert found[:, 0].tolist() == [*names, "layer_styles"]
    for layer in LAYERS:
        if layer.name not in names:
            continue
        info = pyogrio.read_info(path, layer=layer.name)
        assert info["fields"].tolist() == list(layer.column_names)
        if layer.geometry is not GeometryType.NONE:
            assert info["crs"] == "EPSG:32630"
    parcels = gpd.read_file(path, layer="parcels")
    assert parcels["rim"].dtype == bool
    assert parcels["net_area_m2"].isna().all()
    assert not list(tmp_path.glob("*.aux.xml"))


def test_file_is_a_sound_geopackage_1_3(layout: Layout, tmp_path: Path) -> None:
    path = write_layout(layout, tmp_path / "a.gpkg")
    with closing(sqlite3.connect(path)) as db:
        assert db.execute("PRAGMA user_version").fetchone() == (10300,)
        assert db.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        assert db.execute("PRAGMA foreign_key_check").fetchall() == []
        extensions = {row[0] for row in db.execute("SELECT extension_name FROM gpkg_extensions")}
        assert {"gpkg_rtree_index", "gpkg_schema", "gpkg_metadata"} <= extensions
        alias = db.execute(
            "SELECT name FROM gpkg_data_columns"
            " WHERE table_name = 'parcels' AND column_name = 'area_m2'"
        ).fetchone()
        assert alias == ("Area [m²]",)


def test_qgis_finds_a_default_style_for_every_layer_with_geometry(
    layout: Layout, tmp_path: Path
) -> None:
    path = write_layout(layout, tmp_path / "a.gpkg")
    with closing(sqlite3.connect(path)) as db:
        rows = db.execute(
            "SELECT f_table_name, f_geometry_column, styleQML, useAsDefault FROM layer_styles"
        ).fetchall()
    spatial = [n for n, kind in pyogrio.list_layers(path) if kind is not None]
    assert [row[0] for row in rows] == spatial
    for name, column, qml, default in rows:
        assert (column, default) == ("geom", 1)
        root = ET.fromstring(qml)
        rules = root.findall(".//rule")
        symbols = {s.get("name") for s in root.findall(".//symbols/symbol")}
        assert rules
        assert {rule.get("symbol") for rule in rules} == symbols
        classes = "".join(str(rule.get("filter")) for rule in rules)
        assert name != "streets" or all(
            c in classes for c in ("rim", "fixed", "collector", "local", "cul_de_sac")
        )


def test_layout_without_crs(layout: Layout, tmp_path: Path) -> None:
    plain = layout.replace(frame=Frame())
    read = read_layout(write_layout(plain, tmp_path / "a.gpkg"))
    assert read.crs is None
    assert read.layout.frame == Frame()
    with pytest.raises(OutputError, match="no CRS"):
        export_layout(plain, tmp_path / "out")


def test_existing_output_is_kept_unless_told_otherwise(layout: Layout, tmp_path: Path) -> None:
    path = tmp_path / "a.gpkg"
    path.write_text("precious")
    with pytest.raises(OutputError, match="--overwrite"):
        write_layout(layout, path)
    assert path.read_text() == "precious"
    write_layout(layout, path, overwrite=True)
    assert len(read_layout(path).parcels) == layout.mesh.n_faces


@pytest.mark.parametrize("end", ["-journal", "-wal"])
def test_output_open_elsewhere_is_refused(layout: Layout, tmp_path: Path, end: str) -> None:
    path = write_layout(layout, tmp_path / "a.gpkg")
    (tmp_path / f"a.gpkg{end}").touch()
    with pytest.raises(OutputError, match="open in another program"):
        write_layout(layout, path, overwrite=True)


def test_all_problems_of_an_output_are_told(tmp_path: Path) -> None:
    problems = check_output(tmp_path / "missing" / "a.shp")
    assert len(problems) == 2
    assert ".gpkg" in problems[0]
    assert "does not exist" in problems[1]
    (tmp_path / "folder.gpkg").mkdir()
    assert "is a folder" in check_output(tmp_path / "folder.gpkg")[0]
    assert check_output(tmp_path / "a.gpkg") == []


def test_unwritable_folder_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.access", lambda path, mode: False)
    assert "not writable" in check_output(tmp_path / "a.gpkg")[0]


@pytest.mark.parametrize("stop", [KeyboardInterrupt, OSError(28, "No space left on device")])
def test_stopped_write_leaves_nothing_and_harms_nothing(
    layout: Layout, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stop: BaseException
) -> None:
    path = write_layout(layout, tmp_path / "a.gpkg")
    before = digest(path)

    def write(temporary: Path, *args: object, **kwargs: object) -> None:
        temporary.write_text("half")
        raise stop

    monkeypatch.setattr(files, "write_geopackage", write)
    with pytest.raises((KeyboardInterrupt, OutputError)):
        write_layout(layout, path, overwrite=True)
    assert [p.name for p in tmp_path.iterdir()] == ["a.gpkg"]
    assert digest(path) == before


def test_other_files_are_no_layouts(tmp_path: Path) -> None:
    with pytest.raises(BoundaryError, match="does not exist"):
        read_layout(tmp_path / "a.gpkg")
    gpd.GeoSeries([shapely.box(0, 0, 1, 1)], crs=32630).to_file(tmp_path / "b.gpkg")
    (tmp_path / "c.gpkg").write_text("not a database")
    for name in ("b.gpkg", "c.gpkg"):
        with pytest.raises(BoundaryError, match="not a layout file"):
            read_layout(tmp_path / name)


def test_edited_parcels_that_no_longer_fit_are_told(layout: Layout, tmp_path: Path) -> None:
    path = write_layout(layout, tmp_path / "a.gpkg")
    read = pyogrio.read_dataframe(path, layer="streets")
    read.geometry = read.geometry.translate(0.5)
    pyogrio.write_dataframe(read, path, layer="streets")
    with pytest.raises(TopologyError, match="do not fit together"):
        read_layout(path)


def test_newer_files_are_refused(
    layout: Layout, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(files, "FILE_FORMAT", 2)
    path = write_layout(layout, tmp_path / "a.gpkg")
    monkeypatch.setattr(files, "FILE_FORMAT", 1)
    with pytest.raises(BoundaryError, match="newer version"):
        read_layout(path)


def test_frames(layout: Layout) -> None:
    geo = GeoLayout(canonical(layout))
    assert geo.crs == "EPSG:32630"
    assert geo.parcels.index.tolist() == list(range(1, 19))
    assert geo.parcels.area_m2.sum() == pytest.approx(geo.boundary.area.sum())
    assert (geo.streets["class"] == "rim").any()
    assert geo.junctions.geom_type.unique().tolist() == ["Point"]
    assert geo.issues.parcel_id.tolist()[0] == 3
    assert geo.issues.geometry.isna().tolist() == [False, True, False]
    assert geo.provenance.seed.tolist() == [7]
    assert geo.input_boundary.area.sum() == pytest.approx(geo.boundary.area.sum())
    assert geo.metric("parcels") == 18
    assert geo.metric("parcels", part=1) == 4
    with pytest.raises(KeyError, match="no metric 'x'"):
        geo.metric("x")
    assert repr(geo).startswith("GeoLayout(18 parcels, ")
    assert len(geo.frame("obstacles")) == 0
    assert geo.frame("obstacles").crs == "EPSG:32630"


def test_exports(layout: Layout, tmp_path: Path) -> None:
    geo = GeoLayout(canonical(layout))
    folder = export_layout(layout, tmp_path / "json")
    parcels = gpd.read_file(folder / "parcels.geojson")
    assert parcels.crs == "EPSG:4326"
    assert len(parcels) == 18
    back = parcels.to_crs(32630).geometry
    assert shapely.hausdorff_distance(back.values, geo.parcels.geometry.values).max() < 1e-3
    assert len(gpd.read_file(folder / "issues.geojson")) == 3
    assert (folder / "metrics.csv").read_text().startswith("part,metric,value,unit")
    columns = gpd.read_parquet(
        export_layout(layout, tmp_path / "p", kind="parquet") / "parcels.parquet"
    )
    assert columns.crs == "EPSG:32630"
    assert columns.geometry.geom_equals(geo.parcels.geometry.reset_index(drop=True)).all()
    assert sorted(p.stem for p in (tmp_path / "p").iterdir()) == sorted(geo.tables)


def test_exports_refuse_what_is_there(layout: Layout, tmp_path: Path) -> None:
    (tmp_path / "streets.geojson").write_text("precious")
    assert "streets.geojson" in check_export(tmp_path)[0]
    assert check_export(tmp_path, kind="parquet") == []
    assert check_export(tmp_path, overwrite=True) == []
    assert "does not exist" in check_export(tmp_path / "a" / "b")[0]
    with pytest.raises(OutputError, match="already holds"):
        export_layout(layout, tmp_path)
    with pytest.raises(ParameterError, match="geojson, parquet"):
        check_export(tmp_path, kind="shp")
