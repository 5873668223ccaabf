"""`measure` and `compare` on the command line: what they read and write, and every bad input."""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pyogrio
import pytest
import shapely
from click.testing import CliRunner, Result
from measured_files import (
    CRS,
    frame,
    land,
    osm_town,
    placed,
    plot_frame,
    street_frame,
    write,
)

import urban_processing as up
from urban_processing.cli.app import app

SAMPLES = Path(__file__).resolve().parents[2] / "sample_data"


@dataclass(frozen=True)
class Town:
    """A folder with files; what is missing is made by the tests."""

    folder: Path

    def __truediv__(self, name: str) -> Path:
        return self.folder / name


@pytest.fixture(scope="module")
def town(tmp_path_factory: pytest.TempPathFactory) -> Town:
    folder = tmp_path_factory.mktemp("town")
    up.cogenerate(land(), crs=CRS, min_area=500).save(folder / "layout.gpkg")
    up.cogenerate(land(), crs=CRS, min_area=900, seed=3).save(folder / "other.gpkg")
    write(plot_frame(), folder / "plots.shp")
    write(plot_frame(), folder / "both.gpkg", "plots")
    write(street_frame(), folder / "both.gpkg", "roads")
    write(plot_frame(), folder / "several.gpkg", "plots_2020")
    write(plot_frame(), folder / "several.gpkg", "plots_2024")
    write(street_frame(), folder / "several.gpkg", "roads")
    write(street_frame(), folder / "roads.gpkg")
    write(street_frame().to_crs(25833), folder / "roads_25833.gpkg")
    write(street_frame().translate(50_000).to_frame("geometry"), folder / "far.gpkg")
    write(plot_frame().to_crs(4326), folder / "plots.geojson")
    write(plot_frame(None), folder / "no_crs.gpkg")
    write(frame([land(until=60)]), folder / "west.gpkg")
    write(frame([shapely.Point(placed(shapely.Point(1, 1)))]), folder / "trees.gpkg")
    osm_town(folder / "town.osm")
    return Town(folder)


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(a) for a in arguments], catch_exceptions=False)


def done(*arguments: object) -> Result:
    result = run(*arguments)
    assert result.exit_code == 0, result.output
    return result


def refused(*arguments: object) -> list[str]:
    """The sentences that a call fails with."""
    result = run(*arguments)
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    head, *lines = result.stderr.splitlines()
    assert head.startswith("Error: ")
    return [line.removeprefix("  - ") for line in lines] or [head.removeprefix("Error: ")]


def summary(result: Result) -> dict[str, str]:
    return dict(line.split(maxsplit=1) for line in result.stdout.splitlines())


def metrics(path: Path) -> dict[str, dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return {row["metric"]: row for row in csv.DictReader(file)}


# ---- measure


def test_a_layout_is_measured_into_every_kind_of_file(town: Town, tmp_path: Path) -> None:
    page, figures, table, out = (tmp_path / f"m.{e}" for e in ("html", "json", "csv", "gpkg"))
    picture, plain = tmp_path / "m.png", tmp_path / "plain"
    result = done(
        "measure", town / "layout.gpkg", "--report", page, "--json", figures, "--csv", table,
        "-o", out, "--plot", picture, "--export", plain,
    )  # fmt: skip
    assert {p.name for p in tmp_path.iterdir()} == {
        "m.html", "m.json", "m.csv", "m.gpkg", "m.png", "plain"
    }  # fmt: skip
    rows = summary(result)
    assert [rows[k] for k in ("report", "JSON", "CSV", "layers")] == [
        str(p) for p in (page, figures, table, out)
    ]
    assert result.stderr == ""
    assert "<title>layout: report</title>" in page.read_text()
    told = json.loads(figures.read_text())
    assert told["title"] == "layout"
    assert [side["name"] for side in told["sides"]] == ["layout"]
    assert told["sides"][0]["certificate"]["holds"] is True
    steps = told["sides"][0]["provenance"]
    assert [step["algorithm"] for step in steps] == ["cogenerate", "measure"]
    parcels = pyogrio.read_dataframe(out, layer="parcels")
    written = up.read_layout(town / "layout.gpkg")
    assert parcels.area_m2.tolist() == pytest.approx(written.parcels.area_m2.tolist())
    assert float(metrics(table)["parcels"]["layout"]) == len(parcels)
    assert {"blocks", "streets", "junctions", "metrics"} <= set(pyogrio.list_layers(out)[:, 0])
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert (plain / "parcels.geojson").is_file()


def test_measuring_without_outputs_sums_up(town: Town) -> None:
    result = done("measure", town / "layout.gpkg")
    rows = summary(result)
    assert rows["land"] == "1.15 ha"
    assert "0 with too little frontage for access" in rows["parcels"]
    assert list(rows)[-1] == "time"


def test_quiet_says_nothing(town: Town, tmp_path: Path) -> None:
    out = tmp_path / "m.csv"
    result = done("measure", town / "plots.shp", "--csv", out, "--quiet")
    assert (result.stdout, result.stderr) == ("", "")
    assert metrics(out)["parcels"]["plots"] == "12.0"


def test_layers_give_the_same_whatever_file_they_come_from(town: Town, tmp_path: Path) -> None:
    calls = [
        (town / "both.gpkg",),
        ("--parcel-layer", town / "plots.shp", "--street-layer", town / "roads.gpkg"),
        ("--parcel-layer", f"{town / 'several.gpkg'}|layername=plots_2024",
         "--street-layer", f"{town / 'several.gpkg'}|layername=roads"),
    ]  # fmt: skip
    tables = []
    for k, call in enumerate(calls):
        done("measure", *call, "--csv", tmp_path / f"{k}.csv")
        tables.append((tmp_path / f"{k}.csv").read_text().split("\n", 1))
    names = [head.split(",")[2] for head, _ in tables]
    assert names == ["both", "plots", "several"]
    assert tables[0][1] == tables[1][1] == tables[2][1]
    known = metrics(tmp_path / "0.csv")
    assert known["parcels"]["both"] == "12.0"
    assert known["unreached"]["both"] == "0.0"
    assert known["blocks"]["both"] == "2.0"
    assert float(known["area_mean_m2"]["both"]) == pytest.approx(800.0)
    assert float(known["frontage_mean_m"]["both"]) == pytest.approx(40.0 + 160.0 / 12)


def test_layers_in_other_crss_are_reprojected_and_it_is_said(town: Town, tmp_path: Path) -> None:
    out = tmp_path / "m.csv"
    result = done(
        "measure", "--parcel-layer", town / "plots.shp", "--street-layer",
        town / "roads_25833.gpkg", "--csv", out,
    )  # fmt: skip
    assert "The streets are in ETRS89 / UTM zone 33N (EPSG:25833), not in the CRS of the" in (
        result.stderr
    )
    assert float(metrics(out)["frontage_mean_m"]["plots"]) == pytest.approx(160 / 3, abs=0.01)
    result = done("measure", town / "plots.geojson", "--crs", CRS, "--csv", tmp_path / "g.csv")
    assert float(metrics(tmp_path / "g.csv")["area_mean_m2"]["plots"]) == pytest.approx(800, 1e-3)


def test_land_cuts_what_is_measured(town: Town, tmp_path: Path) -> None:
    result = done(
        "measure", "--parcel-layer", town / "plots.shp", "--street-layer", town / "roads.gpkg",
        "--land", town / "west.gpkg", "--csv", tmp_path / "m.csv",
    )  # fmt: skip
    assert "6 parcel(s) lie outside the land" in result.stderr
    assert metrics(tmp_path / "m.csv")["parcels"]["plots"] == "6.0"


def test_files_of_the_other_algorithms_are_measured(town: Town, tmp_path: Path) -> None:
    blocks, parcels = tmp_path / "blocks.gpkg", tmp_path / "parcels.gpkg"
    done("blocks", town / "roads.gpkg", "-o", blocks)
    done("subdivide", blocks, "-o", parcels, "--min-area", 400)
    n = len(pyogrio.read_dataframe(parcels, layer="parcels"))
    result = done("measure", parcels, "--csv", tmp_path / "p.csv")
    assert "There are no streets" in result.stderr
    assert metrics(tmp_path / "p.csv")["parcels"]["parcels"] == f"{n:.1f}"
    assert "frontage for access" not in result.stdout
    (said,) = refused("measure", blocks)
    assert "There are neither parcels nor streets in " in said
    done("measure", town / "layout.gpkg", "-o", tmp_path / "once.gpkg")
    again = done("measure", tmp_path / "once.gpkg", "--csv", tmp_path / "twice.csv")
    assert metrics(tmp_path / "twice.csv")["unreached"]["once"] == "0.0"
    assert "Parcels run to the centreline of streets" in again.stderr


def test_a_file_without_a_crs_is_given_one(town: Town) -> None:
    (said,) = refused("measure", town / "no_crs.gpkg")
    assert "no_crs.gpkg has no CRS. Give it with crs (--crs EPSG:code)" in said
    result = done("measure", town / "no_crs.gpkg", "--crs", CRS)
    assert "has no CRS; WGS 84 / UTM zone 33N (EPSG:32633) was taken for it." in result.stderr
    (said,) = refused("measure", town / "layout.gpkg", "--crs", CRS)
    assert said == "A layout is ready as it is: leave out crs."


# ---- compare


def test_a_layout_and_openstreetmap(town: Town, tmp_path: Path) -> None:
    page, figures, table, out = (tmp_path / f"c.{e}" for e in ("html", "json", "csv", "gpkg"))
    result = done(
        "compare", town / "layout.gpkg", "--osm-file", town / "town.osm", "--report", page,
        "--json", figures, "--csv", table, "-o", out,
    )  # fmt: skip
    notes = result.stderr.splitlines()
    assert (
        f"OpenStreetMap: Streets of {town / 'town.osm'}: © OpenStreetMap contributors" in (notes[0])
    )
    assert all(note.startswith("OpenStreetMap: ") for note in notes)
    told = json.loads(figures.read_text())
    assert [side["name"] for side in told["sides"]] == ["layout", "OpenStreetMap"]
    assert told["reference"] == "OpenStreetMap"
    assert "layout" in page.read_text()
    row = metrics(table)["street_length_m"]
    comparison = pyogrio.read_dataframe(out, layer="comparison").set_index("metric")
    assert comparison.loc["street_length_m", "value"] == pytest.approx(float(row["layout"]))
    assert comparison.loc["street_length_m", "reference_value"] == pytest.approx(
        float(row["OpenStreetMap"])
    )


def test_sides_have_names_and_a_reference(town: Town, tmp_path: Path) -> None:
    out = tmp_path / "c.json"
    call = [f"small={town / 'layout.gpkg'}", town / "other.gpkg", town / "both.gpkg"]
    done("compare", *call, "--json", out)
    told = json.loads(out.read_text())
    assert [side["name"] for side in told["sides"]] == ["small", "other", "both"]
    assert told["reference"] == "small"
    done("compare", *call, "--json", out, "--overwrite", "--reference", "other")
    told = json.loads(out.read_text())
    assert told["reference"] == "other"
    (row,) = (m for m in told["metrics"] if m["name"] == "parcels")
    assert row["differences"]["other"] == 0


def test_a_side_twice_differs_in_nothing(town: Town, tmp_path: Path) -> None:
    out = tmp_path / "c.json"
    result = done("compare", town / "layout.gpkg", town / "layout.gpkg", "--json", out)
    told = json.loads(out.read_text())
    assert [side["name"] for side in told["sides"]] == ["layout", "layout (2)"]
    assert {v for m in told["metrics"] for v in m["differences"].values()} <= {0.0, None}
    assert not any(d["more_than_noise"] for d in told["distances"])
    assert summary(result)["better"].startswith("layout in 0, layout (2) in 0")


def test_real_parcels_and_the_streets_of_openstreetmap(town: Town, tmp_path: Path) -> None:
    out = tmp_path / "c.csv"
    result = done(
        "compare", town / "layout.gpkg", "--parcel-layer", town / "plots.shp", "--osm-file",
        town / "town.osm", "--csv", out,
    )  # fmt: skip
    known = metrics(out)
    assert known["parcels"]["real"] == "12.0"
    assert known["unreached"]["real"] == "0.0"
    assert any(line.startswith("real: Streets of") for line in result.stderr.splitlines())


@pytest.mark.parametrize("option", ["report", "json", "csv", "output"])
def test_each_output_alone(town: Town, tmp_path: Path, option: str) -> None:
    ending = {"report": "html", "output": "gpkg"}.get(option, option)
    out = tmp_path / f"c.{ending}"
    done("compare", town / "layout.gpkg", town / "other.gpkg", f"--{option}", out)
    assert [p.name for p in tmp_path.iterdir()] == [out.name]
    (said,) = refused("compare", town / "layout.gpkg", town / "other.gpkg", f"--{option}", out)
    assert "exists already" in said
    before = out.read_bytes()
    done("compare", town / "layout.gpkg", town / "other.gpkg", f"--{option}", out, "--overwrite")
    assert out.read_bytes() == before


# ---- bad input


Call = Callable[[Town], list[object]]


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda t: ["measure"], "Give LAYOUT, a layout file, or another file with"),
        (lambda t: ["measure", "--land", t / "west.gpkg"], "or layers with --parcel-layer and"),
        (lambda t: ["measure", t / "layout.gpkg", "--street-layer", t / "roads.gpkg"],
         "Give LAYOUT, or --parcel-layer and --street-layer, not both."),
        (lambda t: ["measure", t / "none.gpkg"], "none.gpkg does not exist."),
        (lambda t: ["measure", __file__], "it is no layout file, and no other file"),
        (lambda t: ["measure", t / "town.osm"], "is an extract of OpenStreetMap: compare a"),
        (lambda t: ["measure", t / "trees.gpkg"], "has neither polygons nor lines; its layers"),
        (lambda t: ["measure", t / "several.gpkg"],
         "has several layers of polygons: plots_2020, plots_2024. Give parcels and streets one"),
        (lambda t: ["measure", f"{t / 'both.gpkg'}|layername=plots"],
         "is one layer: give it as parcels (--parcel-layer) or as streets (--street-layer)."),
        (lambda t: ["measure", "--parcel-layer", t / "plots.shp", "--street-layer",
                    t / "far.gpkg"], "The parcels and the streets do not overlap"),
        (lambda t: ["measure", "--parcel-layer", t / "roads.gpkg"], "5 lines, but no polygon"),
        (lambda t: ["measure", "--street-layer", t / "plots.shp"], "Streets must be lines"),
        (lambda t: ["measure", "--parcel-layer", f"{t / 'both.gpkg'}|layername=huts"], "huts"),
        (lambda t: ["compare"], "Give LAYOUTS, one file or more"),
        (lambda t: ["compare", t / "layout.gpkg"], "A comparison needs two sides"),
        (lambda t: ["compare", t / "layout.gpkg", "--land", t / "west.gpkg", t / "other.gpkg"],
         "Land is for what is there, of which nothing was given"),
        (lambda t: ["compare", t / "layout.gpkg", t / "other.gpkg", "--reference", "foo"],
         "There is no side called 'foo' to compare with: the sides are layout, other."),
        (lambda t: ["compare", t / "layout.gpkg", "--osm", "--osm-file", t / "town.osm"],
         "Give osm (--osm) or osm_file (--osm-file), not both."),
        (lambda t: ["compare", t / "layout.gpkg", "--street-layer", t / "roads.gpkg", "--osm-file",
                    t / "town.osm"], "come from OpenStreetMap or from a layer"),
        (lambda t: ["compare", t / "layout.gpkg", "--osm-file", t / "roads.gpkg"],
         "roads.gpkg cannot be read as OpenStreetMap data"),
        (lambda t: ["compare", t / "layout.gpkg", "--osm-file", t / "no.osm"], "does not exist"),
        (lambda t: ["compare", t / "layout.gpkg", "--street-layer", t / "far.gpkg"],
         "The land and the streets do not overlap"),
        (lambda t: ["compare", t / "layout.gpkg", "--osm-file",
                    SAMPLES / "osm_liechtenstein.osm.bz2"], "No street enters the boundary"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_one_sentence(town: Town, tmp_path: Path, call: Call, said: str) -> None:
    out = tmp_path / "out.json"
    (sentence,) = refused(*call(town), "--json", out)
    assert said in sentence
    assert not list(tmp_path.iterdir())


def test_all_that_is_wrong_is_told_together(town: Town, tmp_path: Path) -> None:
    said = refused(
        "measure", "--parcel-layer", town / "none.shp", "--street-layer", town / "nor.shp",
        "--street-reach", "900", "--csv", tmp_path / "x.txt", "--json", "/nowhere/x.json",
    )  # fmt: skip
    wanted = ["street-reach must be at most", "/nowhere does not", "x.txt must end in .csv"]
    wanted += ["none.shp does not exist", "nor.shp does not exist"]
    assert [[w in s for s in said].count(True) for w in wanted] == [1] * 5, said
    said = refused(
        "compare", town / "none.gpkg", f"b={town / 'nor.gpkg'}", "--osm-file", town / "no.osm",
        "--resamples", "1",
    )  # fmt: skip
    wanted = ["resamples must be", "none.gpkg does not", "nor.gpkg does not", "no.osm does not"]
    assert [[w in s for s in said].count(True) for w in wanted] == [1] * 4, said
    assert not list(tmp_path.iterdir())


def test_a_layout_without_a_crs_lies_nowhere_on_earth(town: Town, tmp_path: Path) -> None:
    up.cogenerate(shapely.box(0, 0, 200, 100), min_area=900).save(tmp_path / "plane.gpkg")
    (said,) = refused("compare", tmp_path / "plane.gpkg", "--osm-file", town / "town.osm")
    assert "has no CRS, so it is not known where on earth it lies" in said


def test_no_result_replaces_an_input_or_another(town: Town, tmp_path: Path) -> None:
    made = tmp_path / "made.gpkg"
    made.write_bytes((town / "layout.gpkg").read_bytes())
    call = ["compare", f"a={made}", town / "other.gpkg", "--overwrite"]
    (said,) = refused(*call, "-o", made)
    assert said == f"-o {made} would replace the input {made}: choose another."
    (said,) = refused("measure", made, "-o", made, "--overwrite")
    assert "would replace the input" in said
    layer = f"{made}|layername=parcels"
    (said,) = refused("measure", "--parcel-layer", layer, "-o", made, "--overwrite")
    assert "would replace the input" in said
    assert made.read_bytes() == (town / "layout.gpkg").read_bytes()


@pytest.mark.skipif(os.getuid() == 0, reason="root may write everywhere")
def test_a_folder_that_cannot_be_written_to(town: Town, tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    (said,) = refused("measure", town / "layout.gpkg", "--report", tmp_path / "r.html")
    assert said == f"The folder {tmp_path} is not writable: choose another, or change its rights."


def test_no_call_over_the_network_for_a_call_with_mistakes(
    town: Town, monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: object, **__: object) -> None:
        raise AssertionError("asked the network")

    monkeypatch.setattr("urban_processing.io.osm.fetch_ways", never)
    (said,) = refused("compare", town / "layout.gpkg", "--osm", "--resamples", "1")
    assert said.startswith("resamples must be")
    (said,) = refused("compare", town / "layout.gpkg", town / "none.gpkg", "--osm")
    assert "none.gpkg does not exist" in said


# ---- the same each time


def test_the_same_input_gives_the_same_bytes(town: Town, tmp_path: Path) -> None:
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        outs = [tmp_path / folder / f"o.{e}" for e in ("html", "json", "csv", "gpkg")]
        options = zip(("--report", "--json", "--csv", "-o"), outs, strict=True)
        flat = [value for pair in options for value in pair]
        done("measure", town / "layout.gpkg", *flat)
        for out in outs:
            out.rename(out.with_stem("measured"))
        options = zip(("--report", "--json", "--csv", "-o"), outs, strict=True)
        done("compare", town / "layout.gpkg", town / "both.gpkg", *flat)
    names = sorted(p.name for p in (tmp_path / "a").iterdir())
    assert len(names) == 8
    for name in names:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name


# ---- help


@pytest.mark.parametrize("name", ["measure", "compare"])
def test_help_and_description(name: str) -> None:
    page = done(name, "--help").stdout
    assert "--street-reach" in page
    assert "--crs" in page
    told = json.loads(done("describe", name, "--json").stdout)
    assert "street_reach" in told["parameters"]["properties"]
    assert done("describe", name).stdout
    assert done("describe", name, "--markdown").stdout
    if name == "compare":
        assert "LAYOUTS..." in page
