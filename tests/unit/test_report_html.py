"""The report: complete, well formed, the same each time, and safe with any text."""

from __future__ import annotations

import csv
import io
import itertools
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from grid_layouts import boxes, grid, layout_of
from hypothesis import example, given, settings
from hypothesis import strategies as st
from reports import (
    NASTY,
    Reader,
    compared,
    one_report,
    side_of,
    small_grid,
    two_reports,
    undefined,
    with_column,
    with_issues,
    without,
)

from urban_processing.errors import OutputError
from urban_processing.metrics.certificate import Certificate, Check
from urban_processing.metrics.comparison import better_side
from urban_processing.metrics.distributions import DISTRIBUTIONS, Sample
from urban_processing.metrics.histograms import histogram
from urban_processing.metrics.registry import METRICS
from urban_processing.report.html import (
    Report,
    report_csv,
    report_html,
    report_json,
    report_problems,
    write_csv,
    write_json,
    write_report,
)
from urban_processing.report.html.charts import chart, line_of
from urban_processing.report.html.digits import decimals_for, number, signed
from urban_processing.report.html.labels import GROUPS, group, label
from urban_processing.report.html.maps import map_sheet
from urban_processing.report.html.metric_rows import metric_groups, one_sided
from urban_processing.report.html.records import issue_list
from urban_processing.report.html.sentences import first_figures
from urban_processing.report.html.summary import verdict
from urban_processing.report.html.svg import area_paths, stage_of
from urban_processing.report.html.text import isolate
from urban_processing.report.html.themes import HATCHED, MOST_EDGES, round_edges, themes

SECTIONS = [
    "summary",
    "maps",
    "metrics",
    "distributions",
    "certificate",
    "issues",
    "provenance",
    "glossary",
]


def many_reports() -> dict[str, Report]:
    side = side_of(small_grid())
    alone = side_of(grid(1, 1))
    parts = side_of(layout_of([*boxes(2, 2), *boxes(3, 2, at=(9, 0))], part=[0] * 4 + [1] * 6))
    return {
        "one": one_report(),
        "two": two_reports(),
        "alike": compared([side, replace(side, name="grid again")]),
        "three": compared([side, alone, parts]),
        "one parcel": Report((alone,)),
        "several parts": Report((parts,)),
        "no parcels": Report((without(side, "parcels"),)),
        "no streets": Report((without(side, "streets", "junctions", "blocks"),)),
        "no layers": Report((without(side, *side.layers.names),)),
        "parcels on one side": compared([side, replace(without(side, "parcels"), name="osm")]),
        "no certificate": Report((replace(side, certificate=None),)),
        "nothing defined": Report((undefined(side),)),
        "many issues": Report((with_issues(side, 1000),)),
        "nasty": two_reports(NASTY, NASTY + " 2"),
    }


@pytest.fixture(scope="module")
def reports() -> dict[str, Report]:
    return many_reports()


@pytest.fixture(scope="module")
def pages(reports: dict[str, Report]) -> dict[str, str]:
    return {name: report_html(report) for name, report in reports.items()}


def test_pages_are_well_formed_and_their_ids_are_their_own(pages: dict[str, str]) -> None:
    for name, html in pages.items():
        page = Reader(html)
        ids = page.ids()
        assert len(set(ids)) == len(ids), name
        assert page.elements[0].attributes["lang"] == "en"
        assert page.elements[0].tag == "html"
        assert len(page.all("h1")) == 1
        levels = [int(e.tag[1]) for e in page.all("h1", "h2", "h3", "h4")]
        assert all(b <= a + 1 for a, b in itertools.pairwise(levels)), name
        for element in page.elements:
            for attribute in ("aria-labelledby", "aria-describedby", "for"):
                wanted = element.attributes.get(attribute, "").split()
                assert set(wanted) <= set(ids), (name, element)
            link = element.attributes.get("href", "")
            if link.startswith("#"):
                assert link[1:] in ids, (name, link)


def test_pages_load_nothing_and_run_nothing(pages: dict[str, str]) -> None:
    for name, html in pages.items():
        page = Reader(html)
        assert not page.all("script", "iframe", "object", "embed", "img", "form"), name
        for element in page.elements:
            assert not [a for a in element.attributes if a.startswith("on") or a == "src"]
            link = element.attributes.get("href", "#")
            assert link.startswith("#") or link == "data:,", link
        assert "url(http" not in html
        assert "@import" not in html
        (policy,) = [e for e in page.all("meta") if "http-equiv" in e.attributes]
        assert policy.attributes["content"].startswith("default-src 'none'")


def test_all_sections_tables_and_pictures_have_names(pages: dict[str, str]) -> None:
    for name, html in pages.items():
        page = Reader(html)
        for table in page.all("table"):
            assert table.above[-1] == "div"
        regions = [e for e in page.elements if e.attributes.get("role") == "region"]
        assert len(regions) == len(page.all("table")) == len(page.all("caption")), name
        assert all(e.attributes["tabindex"] == "0" for e in regions)
        assert all("scope" in e.attributes for e in page.all("th")), name
        shown = [e for e in page.all("svg") if e.attributes.get("aria-hidden") != "true"]
        for picture in shown:
            assert picture.attributes["role"] == "img"
            assert len(picture.attributes["aria-labelledby"].split()) == 2
        texts = {e.attributes["id"]: e.text for e in page.elements if "id" in e.attributes}
        for picture in shown:
            for wanted in picture.attributes["aria-labelledby"].split():
                assert texts[wanted].strip(), (name, wanted)


def test_the_page_has_all_sections_in_order(pages: dict[str, str]) -> None:
    page = Reader(pages["one"])
    assert [e.attributes["id"] for e in page.all("h2")] == SECTIONS
    links = [e.attributes["href"] for e in page.all("a") if "nav" in e.above]
    assert links == [f"#{name}" for name in SECTIONS]


def test_every_metric_and_distribution_is_in_the_glossary(pages: dict[str, str]) -> None:
    html = pages["nothing defined"]
    ids = set(Reader(html).ids())
    assert {f"term-{spec.name}" for spec in METRICS} <= ids
    assert {f"values-{spec.name}" for spec in DISTRIBUTIONS} <= ids
    words = " ".join(Reader(html).all("main")[0].text.split())
    for spec in (*METRICS, *DISTRIBUTIONS):
        assert " ".join(spec.definition.split()) in words


def test_the_same_report_gives_the_same_page(pages: dict[str, str]) -> None:
    again = many_reports()
    for name in ("one", "two", "nasty", "several parts"):
        assert report_html(again[name]) == pages[name]
        assert json.dumps(report_json(again[name])) == json.dumps(report_json(again[name]))


def test_how_long_steps_took_is_left_out() -> None:
    slow = replace(small_grid().history[0], seconds=99.0)
    a, b = side_of(small_grid()), side_of(small_grid().replace(history=(slow,)))
    b = replace(b, values=a.values, layers=replace(b.layers, tables=a.layers.tables))
    assert report_html(Report((a,))) == report_html(Report((b,)))


# -- text from files


def test_text_from_files_is_escaped_wherever_it_stands() -> None:
    side = with_column(side_of(small_grid(), NASTY), "parcels", "land_use", NASTY)
    side = with_column(with_issues(side, 3, NASTY), "streets", "class", NASTY)
    check = Check("reached", False, 1.0, 0.0, NASTY, (1,))
    step = replace(side.layers.history[0], algorithm=NASTY, parameters={NASTY: NASTY})
    layers = replace(side.layers, history=(step,), frame=replace(side.layers.frame, crs=NASTY))
    side = replace(side, certificate=Certificate((check,)), layers=layers)
    other = replace(side, name="plain")
    for report in (Report((side,), title=NASTY), compared([side, other], title=NASTY)):
        html = report_html(report)
        page = Reader(html)
        assert not page.all("script", "b")
        assert "\x00" not in html
        assert "\u202e" not in html
        assert "49" not in page.all("h1")[0].text  # not run as a template
        assert "{{ 7 * 7 }}" in page.all("h1")[0].text
        assert "<script>alert(1)</script>" in page.all("h1")[0].text
        assert page.all("title")[0].text.count("\u2068") == page.all("title")[0].text.count(
            "\u2069"
        )


@settings(max_examples=15, deadline=None)
@given(st.text(st.characters(), max_size=30))
@example("a\rb")
@example("\r")
@example("a\r\nb")
def test_any_name_gives_a_page_and_files(name: str) -> None:
    base = GRID_SIDE
    report = compared([replace(base, name=name), replace(base, name="other")], title=name)
    html = report_html(report)
    assert html.encode("utf-8")
    Reader(html)
    json.dumps(report_json(report), ensure_ascii=False).encode("utf-8")
    rows = list(csv.reader(io.StringIO(report_csv(report), newline="")))
    assert {len(row) for row in rows} == {len(rows[0])}


GRID_SIDE = side_of(grid(2, 2))


def test_directions_of_text_stay_where_they_are() -> None:
    assert isolate("plan 2") == "plan 2"
    assert isolate("תוכנית") == "\u2068תוכנית\u2069"
    assert isolate("\u202eabc") == "\u2068abc\u2069"


# -- what the page says


def test_the_certificate_lists_offenders_and_counts_the_rest() -> None:
    many = tuple(range(1, 173))
    checks = (
        Check("coverage", True, 0.0, 0.0, "0 parcels that overlap."),
        Check("reached", False, 172.0, 0.0, "172 parcels that no street reaches.", many),
    )
    side = replace(side_of(small_grid()), certificate=Certificate(checks))
    page = Reader(report_html(Report((side,))))
    text = " ".join(page.all("main")[0].text.split())
    assert "does not hold: 1 of 2 checks fail" in text
    assert "Parcels 1, 2, 3," in text
    assert "49, 50 and 122 more." in text
    assert "51, 52" not in text


def test_issues_are_counted_and_the_first_are_shown(pages: dict[str, str]) -> None:
    text = " ".join(Reader(pages["many issues"]).all("main")[0].text.split())
    assert "1,000 issues: 500 parcel_small, 500 street_gone." in text
    assert "The first 50 are shown, and 950 more" in text
    assert "too small 49" in text
    assert "too small 50" not in text
    empty = Report((with_issues(side_of(small_grid()), 0),))
    assert "There are none." in report_html(empty)


def test_what_is_not_known_is_said_in_words(pages: dict[str, str]) -> None:
    html = pages["parcels on one side"]
    assert '<span aria-hidden="true">—</span><span class="sr">not known</span>' in html
    assert "Not known of osm." in html
    assert "nan" not in re.sub(r"<[^>]*>", " ", pages["nothing defined"]).lower().split()


def test_the_better_side_is_marked_in_words() -> None:
    report = two_reports()
    assert report.comparison is not None
    html = report_html(report)
    rows = [r for r in report.comparison.rows if r.better is not None]
    assert rows
    assert html.count(">better</span>") == len(rows)
    for row in rows:
        assert better_side(row.values, row.spec.better) == row.better


def test_distances_are_told_in_a_sentence() -> None:
    rng = np.random.default_rng(1)
    side = side_of(small_grid(), "old")
    areas = rng.normal(400.0, 30.0, 300)
    old = replace(side, samples={"parcel_area_m2": Sample(areas)})
    new = replace(side, name="new", samples={"parcel_area_m2": Sample(areas + 35.0)})
    html = report_html(compared([old, new]))
    text = " ".join(Reader(html).all("main")[0].text.split())
    assert "On average 35 m² larger in new than in old; the distributions differ by more" in text
    text = " ".join(
        Reader(report_html(compared([old, replace(old, name="b")]))).all("main")[0].text.split()
    )
    assert "On average alike in b and old; the distributions differ no more than by chance" in text


def test_a_report_needs_a_comparison_of_its_own_sides() -> None:
    side = side_of(small_grid())
    two = two_reports()
    with pytest.raises(ValueError, match="needs a side"):
        Report(())
    with pytest.raises(ValueError, match="need a comparison"):
        Report((side, side))
    with pytest.raises(ValueError, match="need a comparison"):
        Report((side,), two.comparison)
    with pytest.raises(ValueError, match="comparison is of"):
        Report((replace(side, name="x"), side), two.comparison)


# -- maps and charts


def test_maps_have_common_classes_and_one_scale(reports: dict[str, Report]) -> None:
    sheet = map_sheet(reports["three"])
    assert sheet is not None
    assert [g.name for g in sheet.groups] == [
        "irregularity",
        "frontage",
        "level",
        "undesirable",
        "streets",
        "blocks",
    ]
    for group_ in sheet.groups:
        # one side is a single parcel without streets inside, whose cuts are known all the same
        assert len(group_.panels) == 3
        assert all(len(row.amounts) == 3 for row in group_.legend)
    # the bar is as long as it says
    widths = [s.table("boundary") for s in reports["three"].sides]
    extent = max(np.ptp(shapely.total_bounds(t.shapes)[[0, 2]]) for t in widths if t is not None)
    metres = float(sheet.bar_label.split("\u00a0")[0])
    assert sheet.bar_label.endswith("\u00a0m")
    shown = metres / (sheet.bar_percent / 100)
    assert 1.02 * extent <= shown <= 1.15 * extent
    for panel in sheet.groups[0].panels:
        numbers = re.findall(r'd="M(\d+) (\d+)', panel.shapes)
        assert all(int(x) <= sheet.width and int(y) <= sheet.height for x, y in numbers)


def test_a_map_is_only_of_sides_that_have_something_to_show(reports: dict[str, Report]) -> None:
    sheet = map_sheet(reports["parcels on one side"])
    assert sheet is not None
    shown = {g.name: [panel.side for panel in g.panels] for g in sheet.groups}
    assert list(shown)[:2] == ["streets", "blocks"]  # what all have comes first
    assert shown["streets"] == shown["blocks"] == ["grid", "osm"]
    assert shown["irregularity"] == shown["level"] == ["grid"]
    for group_ in sheet.groups:
        assert all(len(row.amounts) == len(group_.panels) for row in group_.legend)
        assert ("Not known of osm." in group_.note) == (len(group_.panels) == 1)
    side = side_of(small_grid(), "as found")
    parcels = side.table("parcels")
    assert parcels is not None
    parcels.columns["level"][:] = np.nan
    sheet = map_sheet(compared([side_of(small_grid()), side]))
    assert sheet is not None
    (level,) = [g for g in sheet.groups if g.name == "level"]
    assert [panel.side for panel in level.panels] == ["grid"]
    assert "Not known of as found." in level.note
    sheet = map_sheet(Report((side,)))
    assert sheet is not None
    assert "level" not in [g.name for g in sheet.groups]


@given(
    st.floats(1.0, 1e7),
    st.floats(1.0, 1e5),
)
@example(1.0, 1.001953125)
@example(1.0, 1.0001)
@example(9.99, 1.002)
def test_edges_of_classes_are_round_and_lie_between(low: float, ratio: float) -> None:
    edges = round_edges(low, low * ratio)
    assert len(edges) <= MOST_EDGES
    assert edges == sorted(set(edges))
    assert all(low * (1 - 1e-6) <= edge <= low * ratio * (1 + 1e-6) for edge in edges)
    assert edges or ratio < 1.0011
    # labels have six digits
    assert [float(f"{edge:g}") for edge in edges] == pytest.approx(edges, rel=1e-9)


def test_blocks_are_counted_in_the_class_of_their_area() -> None:
    sheet = map_sheet(two_reports())
    assert sheet is not None
    (blocks,) = [g for g in sheet.groups if g.name == "blocks"]
    for k, panel in enumerate(blocks.panels):
        areas = re.findall(r'<path fill="([^"]+)" d="([^"]+)"', panel.shapes)
        for fill, d in areas:
            (row,) = [r for r in blocks.legend if r.fill == fill]
            assert row.amounts[k].split(" ")[0] == str(d.count("M"))


def test_every_parcel_is_drawn_once_in_the_colour_of_its_class() -> None:
    report = one_report()
    sheet = map_sheet(report)
    assert sheet is not None
    for group_ in (g for g in sheet.groups if g.counts == "Parcels"):
        areas = re.findall(r'<path fill="([^"]+)" d="([^"]+)"', group_.panels[0].shapes)
        assert sum(d.count("M") for _, d in areas) == 20
        for fill, d in areas:
            (row,) = [r for r in group_.legend if r.fill == fill]
            assert row.amounts[0].split(" ")[0] == str(d.count("M"))


def test_a_square_is_drawn_as_one() -> None:
    stage = stage_of([(0.0, 0.0, 100.0, 100.0)], 100.0)
    canvas = stage.canvas((0.0, 0.0, 100.0, 100.0))
    square = shapely.box(0, 0, 100, 100)
    hole = shapely.Polygon(square.exterior, [shapely.box(40, 40, 60, 60).exterior])
    (path,) = area_paths(np.array([square], dtype=object), canvas)
    numbers = [int(n) for n in re.findall(r"-?\d+", path)]
    side = round(100 * canvas.factor)
    assert len(numbers) == 8
    assert {abs(n) for n in numbers[2:]} <= {0, side, side - 1, side + 1}
    (path,) = area_paths(np.array([hole], dtype=object), canvas)
    assert path.count("M") == path.count("z") == 2
    assert area_paths(np.array([shapely.Polygon()], dtype=object), canvas) == [""]


def test_classes_cover_all_values_and_no_frontage_is_hatched() -> None:
    layout = grid(5, 5, rim=False)
    parcels = side_of(layout).table("parcels")
    assert parcels is not None
    for theme in themes([{"parcels": parcels}]):
        of = theme.class_of(parcels)
        assert of.min() >= 0
        assert of.max() < len(theme.classes)
        if theme.name == "frontage":
            assert theme.classes[int(of[0])].fill == HATCHED
            assert theme.sentence(parcels).startswith("25 of 25 parcels (100\u00a0%) have no")


def test_many_land_uses_and_classes_share_what_is_left() -> None:
    side = side_of(grid(6, 5))
    for layer, column in (("parcels", "land_use"), ("streets", "class")):
        table = side.table(layer)
        assert table is not None
        table.columns[column][:] = [f"kind {k % 12}" for k in range(len(table))]
    drawn = {layer: side.table(layer) for layer in ("parcels", "streets")}
    found = {t.name: t for t in themes([{k: t for k, t in drawn.items() if t is not None}])}
    for name in ("land-use", "streets"):
        fills = [c.fill for c in found[name].classes]
        assert len(set(fills)) == len(fills)
    assert found["land-use"].classes[-1].label == "other"


def test_lines_of_sides_can_be_told_apart_without_colours() -> None:
    lines = [line_of(k, 6) for k in range(6)]
    assert len({line.dash for line in lines}) == 6
    assert len({line.colour for line in lines}) == 6
    assert line_of(0, 1).dash == ""


def test_charts_hold_what_they_count(reports: dict[str, Report]) -> None:
    for h in reports["three"].histograms():
        drawn = chart(h)
        numbers = [
            float(n)
            for n in re.findall(r"-?\d+\.?\d*", re.sub(r"<text.*?</text>", "", drawn.shapes))
        ]
        assert np.isfinite(numbers).all()
        assert drawn.shapes.count("stroke-width") == int(h.shares.any(axis=1).sum())


@pytest.mark.parametrize(
    ("low", "high"), [(0.0, 1.0), (0.0, 2.6e6), (47000.0, 155000.0), (-0.5, 7.5), (3.0, 3.5)]
)
def test_ticks_are_round_and_have_room(low: float, high: float) -> None:
    values = np.linspace(low, high, 400)
    spec = next(d for d in DISTRIBUTIONS if d.name == "parcel_area_m2")
    spec = replace(spec, unit="m", whole=low < 0)
    drawn = chart(histogram(spec, [Sample(values)]))
    labels = re.findall(r'<text x="([\d.]+)" y="183" text-anchor="middle">([^<]+)<', drawn.shapes)
    assert len(labels) >= 2
    ends = [(float(x) - 4 * len(text), float(x) + 4 * len(text)) for x, text in labels]
    assert all(a[1] < b[0] for a, b in itertools.pairwise(ends))
    assert ends[-1][1] <= drawn.width


# -- words and numbers


def test_labels_are_different_and_groups_are_known() -> None:
    labels = [label(spec.name) for spec in METRICS]
    assert len(set(labels)) == len(labels)
    assert all(re.fullmatch(r"[A-Z][^_]*(\(p_\w+\))?", text) for text in labels), labels
    assert {group(spec.name) for spec in METRICS} == set(GROUPS)


@pytest.mark.parametrize(
    ("values", "decimals", "texts"),
    [
        ([1273.0, 4.0], 0, ["1,273", "4"]),
        ([0.5, 0.0234], 3, ["0.500", "0.023"]),
        ([95.81, float("nan")], 1, ["95.8", ""]),
        ([-1e-9, 0.0], 0, ["0", "0"]),
        ([1e-7], 0, ["0"]),
        ([-1234.5], 0, ["−1,234"]),
    ],
)
def test_numbers_have_the_digits_that_make_sense(
    values: list[float], decimals: int, texts: list[str]
) -> None:
    assert decimals_for(values) == decimals
    assert [number(v, decimals) for v in values] == texts


def test_metrics_of_one_side_stand_apart(reports: dict[str, Report]) -> None:
    report = reports["parcels on one side"]
    assert report.comparison is not None
    osm = report.sides[1]
    few = {k: v for k, v in osm.values.items() if k in ("area_m2", "blocks", "street_length_m")}
    report = compared([report.sides[0], replace(osm, values=few)])
    assert report.comparison is not None
    common = [line.term for g in metric_groups(report) for line in g.lines]
    assert common == ["area_m2", "street_length_m", "blocks"]
    (alone,) = one_sided(report)
    assert alone.side == "grid"
    rest = [line for g in alone.groups for line in g.lines]
    assert len(common) + len(rest) == len(report.comparison.rows)
    assert all(len(line.values) == 1 and line.better is None for line in rest)
    html = report_html(report)
    assert "Known of grid alone" in html
    assert one_sided(reports["one"]) == one_sided(reports["alike"]) == []


def test_no_difference_is_shown_from_a_reference_without_values() -> None:
    side = side_of(small_grid(), "osm")
    known = {k: v for k, v in side.values.items() if k != "parcels"}
    with_parcels = [replace(side_of(small_grid(), name), samples={}) for name in ("a", "b")]
    report = compared([replace(side, values=known, samples={}), *with_parcels])
    groups = {g.title: g for g in metric_groups(report)}
    assert groups["Blocks"].differs
    some = [line for g in groups.values() for line in g.lines if line.term == "parcels"]
    assert [line.differences for line in some[:1]] == [(("", ""), ("", ""))]
    assert report.heading == "osm, a and b"


def test_the_better_value_looks_different() -> None:
    side = replace(side_of(small_grid(), "a"), samples={})
    sides = [replace(side, values={"p_area": 1.0512}), replace(side, values={"p_area": 1.0514})]
    (group_,) = metric_groups(compared([sides[0], replace(sides[1], name="b")]))
    assert group_.lines[0].values == ("1.0512", "1.0514")
    assert group_.lines[0].better == 0


def test_land_without_streets_says_so() -> None:
    side = replace(side_of(small_grid()), values={"blocks": 0.0, "street_length_m": 0.0})
    text = report_html(Report((side,)))
    assert "<dd>none.</dd>" in text
    assert "<dd>none inside the land.</dd>" in text
    assert "longer than not known" not in text


def test_differences_are_told_in_percent_or_points() -> None:
    side = side_of(small_grid(), "a")
    known = {"area_m2": 200.0, "quads_pct": 50.0, "dead_ends": 0.0, "circuity": 1.0}
    other = {"area_m2": 300.0, "quads_pct": 60.0, "dead_ends": 3.0, "circuity": 1.0}
    report = compared([replace(side, values=known), replace(side, name="b", values=other)])
    found = {line.term: line.differences for g in metric_groups(report) for line in g.lines}
    assert found == {
        "area_m2": (("+100", "+50\u00a0%"),),
        "quads_pct": (("+10", "points"),),
        "dead_ends": (("+3", ""),),
        "circuity": (("0", ""),),
    }


def test_the_verdict_names_what_each_side_is_better_in() -> None:
    side = side_of(small_grid(), "old")
    low = {"circuity": 1.1, "quads_pct": 90.0, "p_area": 1.0, "thinness_min": 0.5}
    high = {"circuity": 1.3, "quads_pct": 80.0, "p_area": 1.0, "thinness_min": 0.6}
    sides = [replace(side, values=low, samples={}), replace(side, name="new", values=high)]
    report = compared([sides[0], replace(sides[1], samples={})])
    assert report.comparison is not None
    assert verdict(report.comparison, ("<old>", "new")) == [
        ("Distributions", "Two sides have no values in common that could be compared."),
        (
            "Better",
            "<old> in 2 and new in 1 of the 4 metrics that both sides have a value of, by what is "
            "commonly wanted (right angles, four sides, short detours); 1 alike.",
        ),
        ("Better in <old>", "Share of quadrilaterals and Circuity."),
        ("Better in new", "Smallest thinness."),
    ]
    assert "Comparison of new with old." in report_html(report)


def test_notes_come_first_and_better_last() -> None:
    report = two_reports("a", "b")
    assert report.comparison is not None
    of = replace(report.comparison, shared_land=(1.0, 0.0))
    told = verdict(of, ("A", "B"))
    assert told[0][0] == "Not the same land"
    assert told[0][1].endswith(": they lie apart.")
    assert " in B, " in told[0][1]
    heads = [head for head, _ in told]
    ends = [head for head in heads if head.startswith("Better")]
    assert ends == heads[-len(ends) :]
    page = Reader(report_html(replace(report, comparison=of)))
    assert page.all("dt")[0].text == "Not the same land"
    assert report_json(replace(report, comparison=of))["notes"][0]["about"] == "lands"


def test_whole_numbers_are_told_by_means_and_what_says_more_than_chance() -> None:
    side = replace(side_of(small_grid(), "a"), values={})
    few, many = np.repeat([2.0, 4.0, 5.0], [40, 100, 10]), np.repeat([2.0, 4.0, 8.0], [10, 100, 40])
    sides = [
        replace(side, name=name, samples={"parcel_neighbours": Sample(values)})
        for name, values in (("a", few), ("b", many))
    ]
    comparison = compared(sides).comparison
    assert comparison is not None
    told = dict(verdict(comparison, ("a", "b")))
    assert told["Neighbours of parcels"].startswith("mean 4.93 in b, 3.53 in a; distance ")
    assert told["Differs most"].startswith("Neighbours of parcels. 1 of 1 distributions differ")
    (d,) = comparison.distances
    shape = replace(d, wasserstein_low=0.0, wasserstein=0.1, wasserstein_noise=0.2, ks_noise=0.125)
    told = dict(verdict(replace(comparison, distances=(shape,)), ("a", "b")))
    said = told["Neighbours of parcels"]
    assert "more than chance by the Kolmogorov-Smirnov statistic, 0.267 where chance" in said
    ways = replace(shape, wasserstein=0.3)
    said = dict(verdict(replace(comparison, distances=(ways,)), ("a", "b")))[
        "Neighbours of parcels"
    ]
    assert said.endswith("more than chance by their distance, above the 0.200 of chance.")


def test_ways_are_told_only_where_there_are_intersections() -> None:
    values = {"network_detour": 1.04, "intersections": 0.0, "dead_ends": 0.0}
    assert "Ways" not in dict(first_figures(values))
    assert "Ways" not in dict(first_figures({"network_detour": 1.04}))
    assert "1.04 times" in dict(first_figures(values | {"intersections": 2.0}))["Ways"]


def test_too_little_frontage_is_told_apart_from_none() -> None:
    said = dict(first_figures({"unreached": 3.0, "frontage_mean_m": 9.0}))["Access"]
    assert said.startswith("3 parcels with too little frontage for access (under 3 m")
    assert "or none" in said


def test_rows_without_a_difference_are_left_out_of_the_summary() -> None:
    side = side_of(small_grid(), "a")
    page = report_html(
        compared([side, replace(side, name="b", values={**side.values, "blocks": 9})])
    )
    table = page[page.index('id="summary-table"') : page.index("Alike in both:")]
    assert '<th scope="row">Blocks</th><td data-side="a">' in table
    assert '<th scope="row">Land</th>' not in table
    assert "Alike in both: land, parcels" in page
    same = report_html(compared([side, replace(side, name="b")]))
    assert 'id="summary-table"' not in same
    assert "Alike in both: land, " in same


def test_notes_from_reading_are_no_issues() -> None:
    side = side_of(small_grid())
    read = with_column(with_issues(side, 3), "issues", "code", "osm_source")
    text = " ".join(Reader(report_html(Report((read,)))).all("main")[0].text.split())
    assert "3 notes from reading." in text
    assert "3 issues" not in text
    table = read.table("issues")
    assert table is not None
    table.columns["code"][0] = "parcel_small"
    assert issue_list("a", table).counts == "1 issue and 2 notes from reading"


def test_small_shares_are_told_in_powers_of_ten() -> None:
    check = Check("land_covered", True, 1.25e-16, 1e-8, "fine")
    text = report_html(Report((replace(GRID_SIDE, certificate=Certificate((check,))),)))
    assert "1.25\u00a0×\u00a010⁻¹⁶" in text
    assert "e-1" not in re.sub(r"<[^>]*>", " ", text)


def test_differences_have_signs() -> None:
    assert [signed(v, 1) for v in (2.0, -2.0, 0.0, 0.01)] == ["+2.0", "−2.0", "0.0", "0.0"]
    assert signed(float("nan"), 1) == ""


# -- files


def test_json_has_all_there_is(reports: dict[str, Report]) -> None:
    for name, report in reports.items():
        found = report_json(report)
        assert list(found) == [
            "format",
            "software",
            "version",
            "title",
            "reference",
            "sides",
            "metrics",
            "distributions",
            "distances",
            "notes",
        ]
        json.dumps(found, allow_nan=False)
        assert len(found["sides"]) == len(report.sides), name
    found = report_json(reports["two"])
    assert found["reference"] == "grid"
    metrics = {m["name"]: m for m in found["metrics"]}
    assert metrics["parcels"]["values"] == {"grid": 20.0, "larger": 24.0}
    assert metrics["parcels"]["differences"] == {"grid": 0.0, "larger": 4.0}
    shares = found["distributions"][0]["sides"]["grid"]["shares"]
    assert sum(shares) == pytest.approx(1.0)
    assert len(report_json(reports["many issues"])["sides"][0]["issues"]) == 1000
    assert len(report_json(reports["several parts"])["sides"][0]["parts"]) == 2


def test_csv_has_a_row_for_each_metric(reports: dict[str, Report]) -> None:
    report = reports["two"]
    assert report.comparison is not None
    rows = list(csv.DictReader(io.StringIO(report_csv(report))))
    assert [r["metric"] for r in rows] == [r.name for r in report.comparison.rows]
    by_name = {r["metric"]: r for r in rows}
    assert (by_name["parcels"]["grid"], by_name["parcels"]["larger"]) == ("20.0", "24.0")
    assert by_name["irregularity_mean"]["better"] == "low"
    head = report_csv(two_reports("metric", "=1+1")).splitlines()[0]
    assert head == "metric,label,metric (2),'=1+1,unit,better,better_side,definition"


@pytest.mark.parametrize(
    ("write", "name"), [(write_report, "r.html"), (write_json, "r.json"), (write_csv, "r.csv")]
)
def test_files_are_written_whole_or_not_at_all(write, name: str, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    report = one_report()
    target = tmp_path / name
    assert write(report, target) == target
    first = target.read_bytes()
    assert first
    with pytest.raises(OutputError, match="exists already"):
        write(report, target)
    assert write(report, str(target), overwrite=True).read_bytes() == first
    with pytest.raises(OutputError, match="must end in"):
        write(report, tmp_path / "r.txt")
    with pytest.raises(OutputError, match="does not exist"):
        write(report, tmp_path / "nowhere" / name)
    assert [p.name for p in tmp_path.iterdir()] == [name]


def test_problems_are_told_before_anything_is_done(tmp_path: Path) -> None:
    assert report_problems(tmp_path / "r.HTML") == []
    (tmp_path / "r.html").write_text("")
    assert len(report_problems(tmp_path / "r.html")) == 1
    assert report_problems(tmp_path / "r.html", overwrite=True) == []
