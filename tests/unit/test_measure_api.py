"""`measure` and `compare` from Python: results as frames, reports, errors, cancelling."""

from __future__ import annotations

import hashlib
import json
import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pytest
import shapely
from measured_files import CRS, frame, land, osm_town, placed, plot_frame, plots, street_frame

import urban_processing as up
from urban_processing.errors import (
    BoundaryError,
    Cancelled,
    OutputError,
    ParameterError,
    UrbanError,
)
from urban_processing.metrics.measures import FabricMeasures
from urban_processing.progress import CallbackProgress
from urban_processing.site import FloatArray


@pytest.fixture(scope="module")
def layout() -> up.GeoLayout:
    return up.cogenerate(land(), crs=CRS, min_area=500)


@pytest.fixture(scope="module")
def town() -> up.GeoFabric:
    return up.measure(parcels=plot_frame(), streets=street_frame())


def same(one: up.GeoFabric, other: up.GeoFabric, *, but: tuple[str, ...] = ()) -> None:
    """That all metrics agree."""
    for name, value in one.measures.values.items():
        if name not in but:
            assert other.metric(name) == pytest.approx(value, rel=1e-6, nan_ok=True), name


# ---- measure


def test_a_layout_its_file_and_its_measured_form_give_the_same(
    layout: up.GeoLayout, tmp_path: Path
) -> None:
    file = layout.save(tmp_path / "one.gpkg")
    found = [up.measure(layout), up.measure(file), up.measure(layout.layout)]
    found.append(up.measure(found[0]))
    for each in found[1:]:
        same(found[0], each)
        assert each.parcels.equals(found[0].parcels)
        steps = each.provenance.algorithm.tolist()
        assert steps == ["cogenerate", "measure"]
    for name in ("parcels", "area_mean_m2", "street_length_m", "irregularity_mean"):
        assert found[0].metric(name) == pytest.approx(layout.metric(name))
    assert found[1].measures.fabric.name == "one"


def test_a_layout_as_two_layers_measures_alike(layout: up.GeoLayout) -> None:
    whole = up.measure(layout)
    layers = up.measure(parcels=layout.parcels, streets=layout.streets, land=layout.boundary)
    for name in ("parcels", "area_m2", "area_mean_m2", "quads_pct", "irregularity_mean", "blocks",
                 "unreached", "street_length_m", "intersections", "dead_ends", "perimeter_m",
                 "frontage_mean_m"):  # fmt: skip
        assert layers.metric(name) == pytest.approx(whole.metric(name), rel=1e-3), name


def test_frames_are_those_of_the_layers(town: up.GeoFabric) -> None:
    assert isinstance(town.parcels, gpd.GeoDataFrame)
    assert town.parcels.parcel_id.tolist() == list(range(101, 113))
    assert town.parcels.land_use.value_counts().to_dict() == {"house": 11, "school": 1}
    assert town.parcels.area_m2.sum() == pytest.approx(12 * 800)
    assert town.blocks.parcels.tolist() == [6, 6]
    assert town.crs == CRS
    assert repr(town).startswith("GeoFabric(measured fabric: 12 parcels, ")
    with pytest.raises(AttributeError, match="There is no layer 'houses'; there are parcels"):
        _ = town.houses


def test_one_metric_is_found_by_its_name(town: up.GeoFabric) -> None:
    assert town.metric("parcels") == 12
    table = town.metrics.set_index("metric").value
    assert {name: table[name] for name in ("parcels", "blocks")} == {"parcels": 12, "blocks": 2}
    with pytest.raises(KeyError, match=r"'area_mean'\. Did you mean area_mean_m2"):
        town.metric("area_mean")
    with pytest.raises(KeyError, match="of part 7"):
        town.metric("parcels", part=7)


def test_metrics_of_parts_of_the_land() -> None:
    apart = [plots()[0], placed(shapely.box(500, 0, 520, 40))]
    found = up.measure(parcels=frame(apart), land=frame(apart))
    assert found.metric("parcels") == 2
    assert [found.metric("parcels", part=part) for part in (0, 1)] == [1, 1]


def test_streets_or_parcels_alone() -> None:
    streets = up.measure(streets=street_frame())
    assert math.isnan(streets.metric("parcels"))
    assert streets.metric("blocks") == 2
    with pytest.raises(AttributeError, match="There is no layer 'parcels'"):
        _ = streets.parcels
    parcels = up.measure(plot_frame())
    assert parcels.metric("parcels") == 12
    assert math.isnan(parcels.metric("unreached"))


def test_frontage_at_the_end_of_a_street_makes_no_negative_way(town: up.GeoFabric) -> None:
    """Rounding puts a piece of frontage beyond the end of its street by less than a nanometre."""
    fabric = town.measures.fabric
    parcels = fabric.parcels
    assert parcels is not None
    end = fabric.network.edge_length[parcels.fronts.edge]

    def measured(at: FloatArray) -> FabricMeasures:
        fronts = replace(parcels.fronts, at=at)
        return FabricMeasures(replace(fabric, parcels=replace(parcels, fronts=fronts)))

    at_end, beyond = measured(end), measured(np.nextafter(end, np.inf))
    for name, value in at_end.values.items():
        assert beyond.values[name] == pytest.approx(value, nan_ok=True), name


@pytest.mark.parametrize("ending", ["html", "json", "csv"])
def test_a_report_is_written_as_its_ending_says(
    town: up.GeoFabric, tmp_path: Path, ending: str
) -> None:
    path = town.report(tmp_path / f"town.{ending}")
    text = path.read_text()
    if ending == "html":
        assert text.startswith("<!doctype html>") or text.startswith("<!DOCTYPE html>")
    elif ending == "json":
        values = {m["name"]: m["values"]["layout"] for m in json.loads(text)["metrics"]}
        assert values["parcels"] == 12
    else:
        assert text.startswith("metric,label,layout,")
    with pytest.raises(OutputError, match="exists already"):
        town.report(path)
    assert town.report(path, overwrite=True).read_text() == text


def test_reports_end_in_what_they_are(town: up.GeoFabric, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"must end in \.html, \.json or \.csv"):
        town.report(tmp_path / "town.pdf")
    with pytest.raises(OutputError, match="does not exist"):
        town.report(tmp_path / "none" / "town.html")
    assert not list(tmp_path.iterdir())


def test_what_was_measured_is_saved_drawn_and_exported(town: up.GeoFabric, tmp_path: Path) -> None:
    town.save(tmp_path / "town.gpkg")
    town.plot(tmp_path / "town.png")
    town.export(tmp_path / "plain")
    again = up.measure(tmp_path / "town.gpkg")
    assert again.measures.fabric.name == "town"
    same(town, again, but=("level_max",))
    assert (tmp_path / "plain" / "parcels.geojson").is_file()


# ---- compare


def test_sides_and_tables(layout: up.GeoLayout, town: up.GeoFabric, tmp_path: Path) -> None:
    found = up.compare(layout, town, names=["made"], reference="layout")
    assert list(found.sides) == ["made", "layout"]
    same(found.sides["layout"], town)
    rows = found.comparison.set_index("metric")
    assert rows.loc["parcels", "value"] == layout.metric("parcels")
    assert rows.loc["parcels", "difference"] == layout.metric("parcels") - 12
    assert set(found.distances.side) == {"made"}
    found.report(tmp_path / "c.html")
    found.report(tmp_path / "c.json")
    told = json.loads((tmp_path / "c.json").read_text())
    assert [s["name"] for s in told["sides"]] == ["made", "layout"]
    own = set(json.loads(found.sides["made"].provenance.parameters.iloc[-1]))
    assert own == {field.name for field in up.MeasureParams.fields()}


def test_what_is_there_is_the_reference(layout: up.GeoLayout, tmp_path: Path) -> None:
    osm = osm_town(tmp_path / "town.osm")
    found = up.compare(layout, osm_file=osm)
    assert list(found.sides) == ["layout", "OpenStreetMap"]
    assert set(found.comparison.reference) == {"OpenStreetMap"}
    assert found.sides["OpenStreetMap"].issues.code[0] == "osm_source"
    both = up.compare(layout, parcels=plot_frame(), osm_file=osm)
    assert both.sides["real"].metric("parcels") == 12
    layers = up.compare(layout, parcels=plot_frame(), streets=street_frame())
    assert layers.sides["real"].metric("unreached") == 0


def test_a_mapping_names_the_sides(layout: up.GeoLayout, town: up.GeoFabric) -> None:
    found = up.compare({"plan": layout, "town": town})
    assert list(found.sides) == ["plan", "town"]
    assert found.compared.comparison.shared_land[0] == pytest.approx(1.0)
    for wrong in (({"a": layout}, town), ({"a": layout}, {"b": town})):
        with pytest.raises(ParameterError, match=r"one by one .* names=\["):
            up.compare(*wrong)
    with pytest.raises(ParameterError, match="one mapping of names"):
        up.compare({"a": layout, "b": town}, names=["c"])


def test_other_lands_are_told_first(town: up.GeoFabric) -> None:
    away = up.cogenerate(
        shapely.transform(land(), lambda xy: xy + np.array((5000.0, 0.0))), crs=CRS, min_area=500
    )
    found = up.compare(town, away)
    about, said = found.made.summary[0]
    assert about == "lands"
    assert said.endswith(": they lie apart.")


# ---- errors


def test_all_that_is_wrong_is_told_together(layout: up.GeoLayout) -> None:
    with pytest.raises(UrbanError) as error:
        up.measure("none.gpkg", street_reach=-1, footpath=True)
    assert len(error.value.problems) == 3
    with pytest.raises(UrbanError) as error:
        up.compare("none.gpkg", "nor.gpkg", osm_file="no.osm", resamples=1)
    assert len(error.value.problems) == 4
    with pytest.raises(ParameterError, match="street-reach must be at least 0"):
        up.compare(layout, layout, street_reach=-1)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({}, "Give parcels, streets, or both"),
        ({"parcels": street_frame()}, "no polygon"),
        ({"streets": plot_frame()}, "Streets must be lines"),
        ({"parcels": plot_frame(None)}, "has no CRS"),
        ({"parcels": 7}, "int is nothing that can be read"),
        ({"parcels": []}, "has no features"),
    ],
)
def test_layers_that_cannot_be_measured(given: dict[str, Any], said: str) -> None:
    with pytest.raises(BoundaryError, match=said):
        up.measure(**given)


def test_sides_that_cannot_be_compared(layout: up.GeoLayout) -> None:
    with pytest.raises(ParameterError, match="A comparison needs two sides"):
        up.compare(layout)
    with pytest.raises(ParameterError, match="A comparison needs two sides"):
        up.compare()
    with pytest.raises(ParameterError, match=r"no side called 'x' .*: the sides are layout,"):
        up.compare(layout, layout, reference="x")
    with pytest.raises(ParameterError, match=r"names has 3 names for 2 layout"):
        up.compare(layout, layout, names=["a", "b", "c"])
    assert list(up.compare(layout, layout, names="loops").sides) == ["loops", "layout"]


@pytest.mark.parametrize("after", [0.0, 0.3, 0.9])
def test_a_progress_stops_the_work(layout: up.GeoLayout, after: float) -> None:
    def stop(fraction: float, _: str) -> None:
        if fraction >= after:
            raise Cancelled

    with pytest.raises(Cancelled):
        up.measure(layout, progress=CallbackProgress(stop))
    with pytest.raises(Cancelled):
        up.compare(layout, layout, progress=CallbackProgress(stop))


# ---- the same each time

_SCRIPT = """
import sys
sys.path[:0] = [{tests!r}]
from pathlib import Path
import urban_processing as up
from measured_files import CRS, land, plot_frame, street_frame
out = Path({out!r})
layout = up.cogenerate(land(), crs=CRS, min_area=500)
measured = up.measure(layout)
found = up.compare(measured, up.measure(parcels=plot_frame(), streets=street_frame()))
for name, each in (("m", measured), ("c", found)):
    for ending in ("html", "json", "csv"):
        each.report(out / f"{{name}}.{{ending}}")
    each.save(out / f"{{name}}.gpkg")
"""


def test_two_processes_write_the_same_bytes(tmp_path: Path) -> None:
    digests = []
    running = {}
    for number in ("1", "2"):
        out = tmp_path / number
        out.mkdir()
        script = _SCRIPT.format(tests=str(Path(__file__).parent), out=str(out))
        command = [sys.executable, "-c", script]
        running[out] = subprocess.Popen(command, env={"PYTHONHASHSEED": number})
    for out, process in running.items():
        assert process.wait(timeout=300) == 0
        files = sorted(out.iterdir())
        digests.append({f.name: hashlib.sha256(f.read_bytes()).hexdigest() for f in files})
    assert len(digests[0]) == 8
    assert digests[0] == digests[1]
