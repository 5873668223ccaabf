"""The report in a browser: quiet, self-contained, and never wider than the window."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from chromium import Page, chromium_page, find_chromium
from reports import NASTY, one_report, save, two_reports

from urban_processing.report.html import report_html

PROGRAM = find_chromium()

pytestmark = pytest.mark.skipif(PROGRAM is None, reason="Chromium is not installed")


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    assert PROGRAM is not None
    with chromium_page(PROGRAM, tmp_path_factory.mktemp("profile")) as page:
        yield page


@pytest.fixture(scope="module", params=["one", "two", "nasty"])
def page_file(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    long = "a_very_long_name_without_any_space_in_it_" * 4
    reports = {
        "one": lambda: one_report(title="Grid"),
        "two": two_reports,
        "nasty": lambda: two_reports(NASTY, long),
    }
    html = report_html(reports[request.param]())
    return save(html, tmp_path_factory.mktemp("page"), "report.html")


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 400])
def test_nothing_is_said_asked_for_or_too_wide(
    browser: Page, page_file: Path, width: int, scheme: str
) -> None:
    browser.open(page_file, width=width, scheme=scheme)
    assert browser.said() == []
    assert browser.requests() == [page_file.as_uri()]
    assert browser.value("window.innerWidth") == width
    assert browser.value("document.documentElement.scrollWidth") <= width
    assert browser.value("document.body.scrollWidth") <= width


def test_text_in_charts_is_large_enough_on_a_small_screen(browser: Page, page_file: Path) -> None:
    browser.open(page_file, width=400)
    sizes = browser.value(
        """[...document.querySelectorAll('.chart svg text')].map(t =>
            parseFloat(getComputedStyle(t).fontSize) * t.getScreenCTM().a)"""
    )
    assert sizes
    assert min(sizes) >= 11


def test_cells_of_the_summary_and_the_links_have_room(browser: Page, page_file: Path) -> None:
    browser.open(page_file, width=400)
    nav = browser.value("(u => [u.scrollWidth, u.clientWidth])(document.querySelector('nav ul'))")
    assert nav[0] <= nav[1]
    cells = "[...document.querySelectorAll('.stacked td[data-side]')]"
    widths = browser.value(f"{cells}.map(c => c.getBoundingClientRect().width)")
    assert all(width > 300 for width in widths)
    named = browser.value(f"{cells}.map(c => getComputedStyle(c, '::before').content)")
    assert all(text not in ("", "none") for text in named)
    browser.open(page_file, width=1280)
    named = browser.value(f"{cells}.map(c => getComputedStyle(c, '::before').content)")
    assert set(named) <= {"none"}


def test_maps_show_colours_and_the_bar_has_its_length(browser: Page, page_file: Path) -> None:
    browser.open(page_file)
    boxes = browser.value(
        """[...document.querySelectorAll('.map')].map(f => {
            const map = f.querySelector('svg').getBoundingClientRect();
            const bar = f.querySelector('.rule');
            return [map.width, map.height, bar.getBoundingClientRect().width,
                    parseFloat(bar.style.width) / 100];
        })"""
    )
    assert boxes
    for width, height, bar, share in boxes:
        assert width > 250
        assert height > 100
        assert bar == pytest.approx(width * share, rel=0.03)
    fills = browser.value(
        "[...document.querySelectorAll('.map path[fill]')].map(p => getComputedStyle(p).fill)"
    )
    assert len(set(fills)) > 3


def test_links_lead_somewhere_and_focus_is_seen(browser: Page, page_file: Path) -> None:
    browser.open(page_file)
    lost = browser.value(
        """[...document.querySelectorAll('a[href^="#"], use')].map(a => a.getAttribute('href'))
            .filter(h => !document.getElementById(decodeURIComponent(h.slice(1))))"""
    )
    assert lost == []
    browser.ask("Input.dispatchKeyEvent", type="keyDown", key="Tab", code="Tab")
    browser.ask("Input.dispatchKeyEvent", type="keyUp", key="Tab", code="Tab")
    skip = "document.activeElement"
    assert browser.value(f"{skip}.className") == "skip"
    assert browser.value(f"{skip}.getBoundingClientRect().left") >= 0


def test_screen_readers_get_names(browser: Page, page_file: Path) -> None:
    browser.open(page_file)
    browser.ask("Accessibility.enable")
    nodes = browser.ask("Accessibility.getFullAXTree")["nodes"]
    browser.ask("Accessibility.disable")
    named = {"image", "img", "figure", "region", "navigation", "link", "table", "heading"}
    seen = [n for n in nodes if not n["ignored"] and n["role"]["value"] in named]
    kinds = {n["role"]["value"] for n in seen}
    assert {"image", "figure", "region", "navigation", "link", "table", "heading"} <= kinds
    nameless = [n for n in seen if not n.get("name", {}).get("value", "").strip()]
    assert nameless == []


def test_it_prints(browser: Page, page_file: Path) -> None:
    browser.open(page_file)
    printed = browser.ask("Page.printToPDF", preferCSSPageSize=True)["data"]
    assert len(printed) > 10_000
