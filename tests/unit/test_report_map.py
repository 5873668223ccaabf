"""Maps: what is drawn, the same each time, without touching the caller's plots."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from grid_layouts import grid
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.figure import Figure

from urban_processing.errors import OutputError, ParameterError
from urban_processing.io.frames import GeoLayout
from urban_processing.layout import Layout
from urban_processing.paths import map_problems
from urban_processing.report.legend import _round_length
from urban_processing.report.map import plot_layout


@pytest.fixture
def layout() -> Layout:
    """A grid with a street that ends inside."""
    return grid(6, 4, [(3, 0), (3, 2)])


@pytest.mark.parametrize(
    ("suffix", "start"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")]
)
def test_same_layout_gives_same_file(
    layout: Layout, tmp_path: Path, suffix: str, start: bytes
) -> None:
    paths = [tmp_path / f"{name}.{suffix}" for name in "ab"]
    for path in paths:
        plot_layout(layout, path, title="Grid")
    first, second = (path.read_bytes() for path in paths)
    assert first.startswith(start)
    assert first == second


def test_parcels_streets_and_ends_are_drawn(layout: Layout) -> None:
    figure = plot_layout(layout)
    (ax,) = figure.axes
    parcels = ax.collections[0]
    assert isinstance(parcels, PathCollection)
    assert len(parcels.get_paths()) == 24
    casing, fill = (c for c in ax.collections if isinstance(c, LineCollection))
    assert (np.asarray(casing.get_linewidths()) > fill.get_linewidths()).all()
    assert casing.get_zorder() < fill.get_zorder()
    (legend,) = [ax.get_legend()]
    assert [t.get_text() for t in legend.get_texts()] == ["24 parcels", "Street", "1 street end"]


def test_irregular_parcels_and_triangles_stand_out() -> None:
    import shapely
    from grid_layouts import layout_of

    polygons = [
        shapely.Polygon([(0, 0), (40, 0), (0, 40)]),
        shapely.Polygon([(40, 0), (140, 0), (140, 10), (0, 40)]),
    ]
    figure = plot_layout(layout_of(polygons))
    texts = [t.get_text() for t in figure.axes[0].get_legend().get_texts()]
    assert "1 triangle" in texts
    assert "1 irregular" in texts
    colours = figure.axes[0].collections[0].get_facecolors()
    assert len({tuple(c) for c in np.round(colours, 3)}) == 2


def test_figure_has_the_shape_of_the_land(layout: Layout) -> None:
    wide = plot_layout(layout).get_size_inches()
    tall = plot_layout(grid(4, 12)).get_size_inches()
    assert wide[0] > wide[1]
    assert tall[1] > tall[0]
    assert max(plot_layout(layout, size=5).get_size_inches()) < 7


def test_given_axes_and_columns(layout: Layout) -> None:
    figure = Figure()
    ax = figure.subplots()
    assert plot_layout(GeoLayout(layout), ax=ax, colour_by="area_m2") is figure
    assert ax.collections[0].get_array() is not None
    assert GeoLayout(layout).plot(colour_by="rim") is not None
    with pytest.raises(ParameterError, match="frontage_m"):
        plot_layout(layout, colour_by="land_use")


def test_nothing_of_the_caller_is_touched(layout: Layout, tmp_path: Path) -> None:
    before = dict(mpl.rcParams)
    plot_layout(layout, tmp_path / "a.svg")
    assert dict(mpl.rcParams) == before
    import sys

    assert (
        "matplotlib.pyplot" not in sys.modules or not sys.modules["matplotlib.pyplot"].get_fignums()
    )


def test_notebooks_show_the_figure(layout: Layout) -> None:
    picture = plot_layout(layout)._repr_png_()  # type: ignore[attr-defined]
    assert picture.startswith(b"\x89PNG")


def test_bad_paths_are_refused(layout: Layout, tmp_path: Path) -> None:
    problems = map_problems(tmp_path / "no" / "a.jpg")
    assert len(problems) == 2
    assert map_problems(tmp_path / "a.PNG") == []
    with pytest.raises(OutputError, match=r"\.png, \.svg, \.pdf"):
        plot_layout(layout, tmp_path / "a.txt")


@pytest.mark.parametrize(("length", "expected"), [(1.0, 1), (7.3, 5), (23.0, 20), (990.0, 500)])
def test_scale_bar_is_round(length: float, expected: float) -> None:
    assert _round_length(length) == expected
