"""The command line: help, runs, and every kind of bad input."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pytest
import shapely
from click.testing import CliRunner, Result

import urban_processing
from urban_processing.algorithms import (
    AlgorithmSpec,
    Input,
    InputKind,
    Output,
    OutputKind,
    get,
    specs,
)
from urban_processing.algorithms.words import duration_in_words
from urban_processing.cli.app import app, make_app
from urban_processing.errors import Cancelled, DependencyError, InfeasibleError
from urban_processing.io.files import read_layout
from urban_processing.layout import Layout
from urban_processing.params import CogenerateParams, option_name
from urban_processing.pipelines.cogenerate import Estimate
from urban_processing.progress import MANY_PARCELS, Progress
from urban_processing.schema import LAID_OUT

CRS = "EPSG:32632"
LAND = shapely.box(500_000, 5_200_000, 500_160, 5_200_100)


@pytest.fixture
def land(tmp_path: Path) -> Path:
    """A rectangle of 160 m by 100 m."""
    return _write(tmp_path / "land.gpkg", [LAND])


def _write(path: Path, geometries: list[Any], crs: str | None = CRS, **options: Any) -> Path:
    frame = gpd.GeoDataFrame({"name": [f"n{i}" for i in range(len(geometries))]})
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "'crs' was not provided")
        frame.set_geometry(gpd.GeoSeries(geometries, crs=crs)).to_file(path, **options)
    return path


def _run(*arguments: object, command: Any = app) -> Result:
    return CliRunner().invoke(command, [str(a) for a in arguments], catch_exceptions=False)


def _cogenerate(*arguments: object) -> Result:
    return _run("cogenerate", *arguments)


def _problems(result: Result) -> list[str]:
    """The sentences of a failed call; none of them a traceback."""
    assert result.exit_code == 2
    assert result.stdout == ""
    lines = result.stderr.splitlines()
    assert lines[0].startswith("Error: ")
    if len(lines) == 1:
        return [lines[0].removeprefix("Error: ")]
    assert lines[0] == f"Error: {len(lines) - 1} things are wrong with this call."
    return [line.removeprefix("  - ") for line in lines[1:]]


# ---- help ------------------------------------------------------------------------------------


def test_the_first_help_page_lists_every_command() -> None:
    text = _run("--help").stdout
    for spec in specs():
        assert spec.name in text
    assert all(name in text for name in ("list", "describe", "--version", "_COMPLETE="))


@pytest.mark.parametrize("spec", specs(), ids=lambda spec: spec.name)
def test_help_shows_every_parameter_with_unit_limits_and_default(spec: AlgorithmSpec) -> None:
    # words may be wrapped: compare without white space and frames
    text = re.sub(r"[\s│]+", "", _run(spec.name, "--help").stdout)
    schema = json.loads(_run("describe", spec.name, "--json").stdout)["parameters"]["properties"]
    for name, shown in schema.items():
        assert f"--{option_name(name)}" in text
        assert shown["description"].replace(" ", "") in text
        note = []
        if "enum" in shown:
            note += [",".join(choice for choice in shown["enum"] if choice)]
        if "exclusiveMinimum" in shown:
            limits = f"above{shown['exclusiveMinimum']:g}"
            note += [limits + (f",atmost{shown['maximum']:g}" if "maximum" in shown else "")]
        if "minimum" in shown and "maximum" in shown:
            note += [f"{shown['minimum']:g}to{shown['maximum']:g}"]
        elif "minimum" in shown:
            note += [f"atleast{shown['minimum']:g}"]
        if isinstance(shown["default"], bool):
            note += ["defaultyes" if shown["default"] else "defaultno"]
        elif shown["default"] is not None:
            note += [f"default{shown['default']}".removesuffix(".0")]
        if "x-per-feature" in shown:
            note += ["oracolumn"]
        assert f"[{';'.join(note)}]" in text if note else True


def test_help_groups_options_and_puts_the_advanced_ones_apart() -> None:
    text = _run("cogenerate", "--help").stdout
    order = [text.index(f" {panel} ─") for panel in ("Input", "Output", "Size", "Advanced")]
    assert order == sorted(order)
    assert text.index("--pattern") < order[-1] < text.index("--access-ratio")
    assert max(len(line) for line in text.partition("Examples")[0].splitlines()) <= 80


def test_list_and_describe() -> None:
    assert "cogenerate" in _run("list").stdout
    text = _run("describe", "cogenerate").stdout
    assert all(field.name in text for field in CogenerateParams.fields())
    assert json.loads(_run("describe", "cogenerate", "--json").stdout)["name"] == "cogenerate"
    assert _run("describe", "cogenerate", "--markdown").stdout.startswith("# Co-generate")


def test_describe_of_an_unknown_name_is_one_sentence() -> None:
    assert "Did you mean cogenerate?" in _problems(_run("describe", "cogen"))[0]


def test_version() -> None:
    assert urban_processing.__version__ in _run("--version").stdout


def test_choices_are_completed_in_the_shell() -> None:
    completed = CliRunner().invoke(
        app,
        [],
        prog_name="urban-processing",
        env={
            "_URBAN_PROCESSING_COMPLETE": "bash_complete",
            "COMP_WORDS": "urban-processing cogenerate --pattern c",
            "COMP_CWORD": "3",
        },
    )
    assert completed.stdout.split() == ["plain,cul-de-sac"]


# ---- runs ------------------------------------------------------------------------------------


def test_a_run_writes_the_layout_the_picture_and_the_export(land: Path, tmp_path: Path) -> None:
    out, plot, export = tmp_path / "out.gpkg", tmp_path / "map.png", tmp_path / "export"
    result = _cogenerate(
        *(land, "-o", out, "--parcels", 8, "--pattern", "tree", "--seed", 3),
        *("--plot", plot, "--export", export),
    )
    assert result.exit_code == 0
    layout = read_layout(out)
    assert len(layout.parcels) == 8
    step = layout.layout.history[-1]
    assert (step.parameters["pattern"], step.seed) == ("tree", 3)
    assert plot.read_bytes().startswith(b"\x89PNG")
    assert json.loads((export / "parcels.geojson").read_text())["features"]
    rows = dict(line.split(maxsplit=1) for line in result.stdout.splitlines())
    assert rows["parcels"].startswith("8 of ")
    assert rows["certificate"].startswith("holds")
    assert (rows["layout"], rows["picture"], rows["export"]) == (str(out), str(plot), str(export))
    assert "about 8 parcels" in result.stderr
    assert (
        "8 parcels"
        not in _cogenerate(*(land, "-o", tmp_path / "quiet.gpkg", "--parcels", 8, "--quiet")).output
    )


def test_the_same_seed_gives_the_same_bytes(land: Path, tmp_path: Path) -> None:
    files = [tmp_path / name for name in ("a.gpkg", "b.gpkg", "c.gpkg")]
    for file in files[:2]:
        assert _cogenerate(land, "-o", file, "--min-area", 900).exit_code == 0
    assert _cogenerate(land, "-o", files[2], "--min-area", 900, "--record-seconds").exit_code == 0
    assert files[0].read_bytes() == files[1].read_bytes()
    seconds = read_layout(files[2]).provenance.seconds
    assert (seconds > 0).all()


def test_overwrite_replaces_and_nothing_else_does(land: Path, tmp_path: Path) -> None:
    out, plot = tmp_path / "out.gpkg", tmp_path / "map.svg"
    call = (land, "-o", out, "--plot", plot, "--parcels")
    assert _cogenerate(*call, 4).exit_code == 0
    before = out.read_bytes(), plot.read_bytes()
    problems = _problems(_cogenerate(*call, 6))
    assert len(problems) == 2
    assert all("--overwrite" in problem for problem in problems)
    assert (out.read_bytes(), plot.read_bytes()) == before
    assert _cogenerate(*call, 6, "--overwrite").exit_code == 0
    assert len(read_layout(out).parcels) == 6


def test_layer_where_crs_and_corners_reach_the_boundary(tmp_path: Path) -> None:
    path = tmp_path / "many.gpkg"
    other = shapely.box(501_000, 5_200_000, 501_100, 5_200_100)
    _write(path, [LAND.buffer(40)], layer="other")
    _write(path, [other, LAND], layer="wanted")
    corners = _write(tmp_path / "corners.gpkg", [shapely.Point(p) for p in LAND.exterior.coords])
    out = tmp_path / "out.gpkg"
    result = _cogenerate(
        *(path, "-o", out, "--parcels", 4, "--layer", "wanted", "--where", "name = 'n1'"),
        *("--crs", "EPSG:25832", "--corners", corners),
    )
    assert result.exit_code == 0
    layout = read_layout(out)
    assert layout.crs.to_epsg() == 25832
    assert layout.boundary.area_m2.sum() == pytest.approx(LAND.area, rel=1e-6)
    assert layout.layout.vertex_corner.sum() == 4


def test_what_was_changed_in_reading_is_said(tmp_path: Path) -> None:
    geographic = gpd.GeoSeries([LAND], crs=CRS).to_crs(4326)[0]
    path = _write(tmp_path / "wgs84.geojson", [geographic], crs="EPSG:4326")
    result = _cogenerate(path, "-o", tmp_path / "out.gpkg", "--parcels", 4)
    assert result.exit_code == 0
    assert "EPSG:4326" in result.stderr
    quiet = _cogenerate(path, "-o", tmp_path / "quiet.gpkg", "--parcels", 4, "-q")
    assert (quiet.exit_code, quiet.output) == (0, "")


def test_land_smaller_than_a_parcel_stays_one_parcel(land: Path, tmp_path: Path) -> None:
    result = _cogenerate(land, "-o", tmp_path / "out.gpkg", "--min-area", 1e6)
    assert result.exit_code == 0
    assert "1 part_below_min_area" in result.stdout
    assert len(read_layout(tmp_path / "out.gpkg").parcels) == 1


def test_a_large_run_is_announced_with_a_warning(
    land: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "urban_processing.pipelines.cogenerate.estimate",
        lambda _site, _params: Estimate(MANY_PARCELS + 1, 90.0),
    )
    monkeypatch.setattr("urban_processing.pipelines.cogenerate.cogenerate", _infeasible)
    result = _cogenerate(land, "-o", tmp_path / "out.gpkg", "--parcels", 4, "--quiet")
    assert result.stderr.startswith("Warning: This run is large: about 20,001 parcels")
    assert "1 min 30 s" in result.stderr


def test_durations_are_said_as_people_say_them() -> None:
    said = [duration_in_words(seconds) for seconds in (0.01, 3.21, 59.4, 75, 3600, 8000)]
    assert said == ["0.1 s", "3.2 s", "59 s", "1 min 15 s", "1 h 0 min", "2 h 13 min"]


# ---- bad input -------------------------------------------------------------------------------


def test_all_mistakes_of_one_call_are_reported_together(tmp_path: Path) -> None:
    problems = _problems(
        _cogenerate(
            *(tmp_path / "missing.gpkg", "--place", "Wandsworth", "--min-area", "nan"),
            *("--parcels", "many", "--pattern", "spiral", "--seed", -1, "--crs", "EPSG:0"),
            *("--plot", tmp_path / "nowhere" / "map.bmp", "--export", tmp_path),
            *("--export-format", "dxf", "--corners", tmp_path / "missing.gpkg"),
        )
    )
    for words in (
        "min-area must be a finite number; got nan.",
        "parcels must be a number; got 'many'.",
        "Give min-area or parcels, not both.",
        "pattern must be one of loop, cul-de-sac, tree; got 'spiral'.",
        "seed must be at least 0; got -1.",
        "Say where the result goes: -o FILE.",
        "nowhere does not exist",
        "must end in one of .png",
        "got 'dxf'",
        "Give BOUNDARY or --place, not both.",
        "missing.gpkg does not exist",
        "EPSG:0",
        "Corners: ",
    ):
        assert any(words in problem for problem in problems), words
    assert list(tmp_path.iterdir()) == []


BAD_BOUNDARIES: dict[str, tuple[list[Any], str | None, str]] = {
    "null": ([None], CRS, "without geometry"),
    "empty": ([shapely.Polygon()], CRS, "without geometry|empty"),
    "line": ([shapely.LineString([(0, 0), (1, 1)])], CRS, "[Ll]ine"),
    "point": ([shapely.Point(0, 0)], CRS, "[Pp]oint"),
    "no CRS": ([LAND], None, "--crs"),
    "specks": ([shapely.box(0, 0, 0.1, 0.1)], CRS, "area of only"),
}


@pytest.mark.parametrize("name", BAD_BOUNDARIES)
def test_a_bad_boundary_and_a_bad_parameter_are_both_said(name: str, tmp_path: Path) -> None:
    geometries, crs, words = BAD_BOUNDARIES[name]
    path = _write(tmp_path / "bad.gpkg", geometries, crs)
    problems = _problems(_cogenerate(path, "-o", tmp_path / "out.gpkg", "--min-area", 0))
    assert problems[0] == "min-area must be above 0 m²; got 0."
    assert re.search(words, " ".join(problems[1:]))
    assert not (tmp_path / "out.gpkg").exists()


@pytest.mark.filterwarnings("ignore:invalid value encountered")
def test_coordinates_must_be_finite(tmp_path: Path) -> None:
    path = tmp_path / "bad.parquet"
    with np.errstate(invalid="ignore"):
        bad = shapely.Polygon([(0, 0), (float("nan"), 10), (10, 10), (10, 0)])
    gpd.GeoSeries([bad], crs=CRS).to_frame("geometry").to_parquet(path)
    problems = _problems(_cogenerate(path, "-o", tmp_path / "out.gpkg", "--parcels", 4))
    assert "finite" in " ".join(problems)


def test_a_bow_tie_is_refused_and_its_place_said(tmp_path: Path) -> None:
    bow = shapely.Polygon([(0, 0), (200, 100), (200, 0), (0, 100)])
    path = _write(tmp_path / "bow.gpkg", [bow])
    problems = _problems(_cogenerate(path, "-o", tmp_path / "out.gpkg", "--parcels", 6))
    assert len(problems) == 1
    assert "bow-tie" in problems[0]
    assert "100 50" in problems[0]


def test_a_file_that_is_no_map_is_one_sentence(tmp_path: Path) -> None:
    path = tmp_path / "notes.gpkg"
    path.write_text("not a map")
    problems = _problems(_cogenerate(path, "-o", tmp_path / "out.gpkg", "--parcels", 4))
    assert len(problems) == 1
    assert "notes.gpkg" in problems[0]


def test_a_missing_layer_and_a_wrong_filter_are_said(land: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.gpkg"
    layer = _problems(_cogenerate(land, "-o", out, "--parcels", 4, "--layer", "nothing"))
    assert "nothing" in layer[0]
    assert "land" in layer[0]  # the layers there are
    assert _problems(_cogenerate(land, "-o", out, "--parcels", 4, "--where", "nix = 1"))
    assert _problems(_cogenerate(land, "-o", out, "--parcels", 4, "--where", "name = 'x'"))


def test_land_and_size_are_needed(tmp_path: Path) -> None:
    problems = _problems(_cogenerate())
    assert len(problems) == 3
    assert "min-area" in problems[0]
    assert "-o FILE" in problems[1]
    assert "--place" in problems[2]


def test_weights_must_not_all_be_zero(land: Path, tmp_path: Path) -> None:
    weights = ("--weight-size", 0, "--weight-regularity", 0, "--weight-access", 0)
    problems = _problems(_cogenerate(land, "-o", tmp_path / "o.gpkg", "--parcels", 4, *weights))
    assert len(problems) == 1
    assert "all zero" in problems[0]


def test_outputs_that_cannot_be_written_are_said_before_the_run(
    land: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("urban_processing.pipelines.cogenerate.cogenerate", _infeasible)

    def problem(out: Path) -> str:
        return " ".join(_problems(_cogenerate(land, "-o", out, "--parcels", 4)))

    assert "does not exist" in problem(tmp_path / "nowhere" / "out.gpkg")
    assert ".gpkg" in problem(tmp_path / "out.shp")
    (tmp_path / "folder.gpkg").mkdir()
    assert "folder" in problem(tmp_path / "folder.gpkg")
    (tmp_path / "open.gpkg-wal").touch()
    assert "open in another program" in problem(tmp_path / "open.gpkg")
    if hasattr(os, "geteuid") and os.geteuid() != 0:
        locked = tmp_path / "locked"
        locked.mkdir(mode=0o500)
        assert "not writable" in problem(locked / "out.gpkg")


def test_outputs_may_not_replace_the_input_or_each_other(land: Path, tmp_path: Path) -> None:
    before = land.read_bytes()
    problems = _problems(_cogenerate(land, "-o", land, "--parcels", 4, "--overwrite"))
    assert f"would replace the input {land}" in problems[0]
    assert land.read_bytes() == before
    same = tmp_path / "same.png"
    problems = _problems(_cogenerate(land, "-o", same, "--plot", same, "--parcels", 4))
    assert any("would replace -o" in problem for problem in problems)


def test_an_unknown_option_gets_a_hint(land: Path) -> None:
    result = _cogenerate(land, "--minarea", 4)
    assert result.exit_code == 2
    assert "--min-area" in result.stderr


# ---- places ----------------------------------------------------------------------------------


def test_a_place_becomes_the_boundary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    frame = gpd.GeoDataFrame(geometry=gpd.GeoSeries([LAND], crs=CRS)).to_crs(4326)
    monkeypatch.setattr("urban_processing.io.places.fetch_place", lambda _name: frame)
    out = tmp_path / "out.gpkg"
    assert _cogenerate("--place", "Here", "-o", out, "--parcels", 4).exit_code == 0
    assert len(read_layout(out).parcels) == 4


def test_without_network_a_place_is_one_clear_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def offline(name: str) -> None:
        raise DependencyError(f"The place {name!r} could not be looked up.")

    monkeypatch.setattr("urban_processing.io.places.fetch_place", offline)
    result = _cogenerate("--place", "Here", "-o", tmp_path / "out.gpkg", "--parcels", 4)
    assert result.exit_code == 1
    assert result.stderr == "Error: The place 'Here' could not be looked up.\n"


def test_no_call_over_the_network_for_a_call_with_mistakes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("urban_processing.io.places.fetch_place", _fail)
    problems = _problems(
        _cogenerate("--place", "Here", "--layer", "x", "-o", tmp_path / "o.gpkg", "--parcels", 0)
    )
    assert len(problems) == 2


# ---- failing and stopping --------------------------------------------------------------------


def _fail(*_arguments: Any) -> None:
    raise AssertionError("must not be called")


def _infeasible(*_arguments: Any) -> None:
    raise InfeasibleError(["This land has no room."])


def test_a_run_that_fails_exits_with_1(
    land: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("urban_processing.pipelines.cogenerate.cogenerate", _infeasible)
    result = _cogenerate(land, "-o", tmp_path / "out.gpkg", "--parcels", 4)
    assert result.exit_code == 1
    assert result.stderr.endswith("Error: This land has no room.\n")


def test_a_bug_is_not_hidden(land: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("urban_processing.pipelines.cogenerate.cogenerate", _fail)
    with pytest.raises(AssertionError, match="must not be called"):
        _cogenerate(land, "-o", tmp_path / "out.gpkg", "--parcels", 4)


@pytest.mark.parametrize("how", [KeyboardInterrupt, Cancelled])
@pytest.mark.parametrize("when", ["run", "write"])
def test_stopping_leaves_no_half_written_file(
    land: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    how: type[BaseException],
    when: str,
) -> None:
    def stop(*_arguments: Any, **_options: Any) -> None:
        raise how

    if when == "run":
        monkeypatch.setattr("urban_processing.pipelines.cogenerate.step", stop)
    else:  # when the file beside the target is there, but not whole
        written = "urban_processing.layout_file.files.write_geopackage"
        monkeypatch.setattr(written, lambda path, *_a, **_k: (path.touch(), stop()))
    out = tmp_path / "out.gpkg"
    out.write_bytes(b"before")
    result = _cogenerate(land, "-o", out, "--parcels", 4, "--overwrite")
    assert result.exit_code == 130
    assert result.stderr.splitlines()[-1] == "Stopped; no file was left half-written."
    assert out.read_bytes() == b"before"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["land.gpkg", "out.gpkg"]


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_ctrl_c_stops_a_real_run(tmp_path: Path) -> None:
    land = _write(tmp_path / "land.gpkg", [LAND.buffer(2000)])
    out = tmp_path / "out.gpkg"
    call = ["cogenerate", str(land), "-o", str(out), "--parcels", "20000"]
    with subprocess.Popen(
        [sys.executable, "-m", "urban_processing", *call],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        env=_environment(),
        # shells start what runs in the background with Ctrl-C ignored
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    ) as process:
        assert process.stderr is not None
        said = process.stderr.readline()
        assert "about 20,000 parcels" in said
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        stdout, stderr = process.communicate(timeout=60)
    assert (process.returncode, stdout) == (130, "")
    assert stderr == "Stopped; no file was left half-written.\n"
    assert [p.name for p in tmp_path.iterdir()] == ["land.gpkg"]


def _environment() -> dict[str, str]:
    """Let a child find the package that is tested here."""
    return {**os.environ, "PYTHONPATH": str(Path(urban_processing.__file__).parents[1])}


def test_help_is_quick(tmp_path: Path) -> None:
    resource = pytest.importorskip("resource")

    def used() -> float:
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return float(usage.ru_utime + usage.ru_stime)

    call = [sys.executable, "-m", "urban_processing", "--help"]
    seconds = []
    for _ in range(3):
        before = used()
        subprocess.run(call, check=True, capture_output=True, cwd=tmp_path, env=_environment())
        seconds.append(used() - before)
    assert min(seconds) < 0.5


# ---- algorithms to come ----------------------------------------------------------------------


def test_a_spec_that_goes_on_from_a_layout_needs_no_new_code(land: Path, tmp_path: Path) -> None:
    def rerun(inputs: Mapping[str, Any], params: Any, progress: Progress) -> Mapping[str, Any]:
        del params
        progress.update(1.0)
        layout: Layout = inputs["layout"]
        return {"output": layout.replace(min_area=layout.min_area / 2)}

    spec = AlgorithmSpec(
        name="relax",
        title="Relax",
        group="Layout",
        summary="Halve the smallest area.",
        description="A layout in, a layout out.",
        params=CogenerateParams,
        inputs=(
            Input(name="layout", kind=InputKind.LAYOUT, label="Layout", help="A layout file."),
        ),
        outputs=(
            Output(
                name="output",
                kind=OutputKind.LAYOUT,
                layers=LAID_OUT,
                label="Layout",
                help="The layout.",
                required=True,
            ),
        ),
        run=rerun,
    )
    command = make_app((get("cogenerate"), spec))
    first, second = tmp_path / "first.gpkg", tmp_path / "second.gpkg"
    assert _run("cogenerate", land, "-o", first, "--min-area", 900, command=command).exit_code == 0
    assert "--place" not in _run("relax", "--help", command=command).stdout
    call = ("relax", first, "-o", second, "--parcels", 1)
    assert _run(*call, command=command).exit_code == 0
    assert read_layout(second).layout.min_area == 450
    missing = _problems(_run("relax", "-o", second, "--parcels", 1, command=command))
    assert missing[0].startswith(f"The output {second} exists")
    assert missing[1] == "Give LAYOUT, a layout file."
    wrong = ("relax", land, "-o", tmp_path / "x.gpkg", "--parcels", 1)
    assert "not a layout file" in _problems(_run(*wrong, command=command))[0]


# ---- export ----------------------------------------------------------------------------------


def test_export_writes_a_layout_file_in_any_format(land: Path, tmp_path: Path) -> None:
    layout, folder = tmp_path / "layout.gpkg", tmp_path / "files"
    assert _cogenerate(land, "-o", layout, "--parcels", 6).exit_code == 0
    for kind, names in (
        ("osm", {"layout.osm", "streets.osm"}),
        ("sumo", {"layout.nod.xml", "layout.edg.xml"}),
        (None, {"parcels.geojson", "metrics.csv"}),
        ("parquet", {"parcels.parquet", "metrics.parquet"}),
    ):
        chosen = () if kind is None else ("--format", kind)
        result = _run("export", layout, "-o", folder, *chosen)
        assert result.exit_code == 0, result.stderr
        assert str(folder) in result.stdout
        assert names <= {path.name for path in folder.iterdir()}
    again = _problems(_run("export", layout, "-o", folder, "--format", "osm"))
    assert again[0].startswith(f"The folder {folder} already holds layout.osm, streets.osm")
    assert _run("export", layout, "-o", folder, "--format", "osm", "--overwrite").exit_code == 0
    # the same files as those written beside the layout
    beside = tmp_path / "beside"
    call = ("-o", tmp_path / "b.gpkg", "--export", beside, "--export-format", "osm")
    assert _cogenerate(land, *call, "--parcels", 6).exit_code == 0
    assert (beside / "layout.osm").read_bytes() == (folder / "layout.osm").read_bytes()


def test_mistakes_of_an_export_are_told_together(land: Path, tmp_path: Path) -> None:
    problems = _problems(_run("export", "--format", "osn", "--snap", 99))
    assert problems == [
        "format must be one of geojson, parquet, osm, sumo; got 'osn'.",
        "snap must be at most 10 m; got 99.",
        "Say where the result goes: -o FOLDER.",
        "Give LAYOUT, a layout file, whose parcels and streets may have been edited.",
    ]
    missing, other = _problems(_run("export", land, "-o", tmp_path / "a" / "b"))
    assert missing == f"The folder {tmp_path / 'a'} does not exist: create it first."
    assert other.startswith(f"{land} is not a layout file")


def test_formats_of_networks_are_for_layouts_alone(tmp_path: Path) -> None:
    assert "geojson, parquet, osm, sumo;" in _words("cogenerate")
    assert "geojson, parquet; default geojson" in _words("blocks")
    streets = tmp_path / "streets.gpkg"
    ring = shapely.LineString(shapely.box(0, 0, 100, 100).exterior)
    gpd.GeoDataFrame(geometry=[ring], crs="EPSG:32630").to_file(streets)
    call = ("-o", tmp_path / "out.gpkg", "--export", tmp_path / "x", "--export-format", "sumo")
    assert _problems(_run("blocks", streets, *call)) == [
        "sumo is a format of layouts, which have a network of streets: choose geojson or parquet."
    ]


def _words(command: str) -> str:
    """The help page of a command without frames and line breaks."""
    return re.sub(r"[\s│]+", " ", _run(command, "--help").stdout)
