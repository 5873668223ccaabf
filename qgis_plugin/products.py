"""What a run makes, one face for all kinds: layers, files, and what there is to say."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from qgis_plugin.geopackage import OGR
from urban_processing.algorithms import OutputKind
from urban_processing.layout import Layout
from urban_processing.layout_file.files import as_written, write_layout
from urban_processing.layout_file.writing import write_layer_set
from urban_processing.metrics import MeasuredLayout
from urban_processing.provenance import Step
from urban_processing.schema import Layer, layer
from urban_processing.tables import LayerSet, Table


@dataclass(frozen=True)
class Product:
    """An output that is stored as a GeoPackage or as single layers.

    Parameters
    ----------
    crs
        CRS of the geometries as text.
    layers
        Rows of the layers it has.
    history
        How it came about, one sentence for each step.
    summary
        The few figures that a run ends with.
    broken
        Promises that do not hold, one sentence for each.
    write, plot
        Write the GeoPackage, draw the map.
    """

    crs: str
    layers: Mapping[Layer, Table]
    history: Sequence[str]
    summary: Sequence[tuple[str, str]]
    broken: Sequence[str]
    write: Callable[[Path], object]
    plot: Callable[[Path], object]

    def layer(self, declared: Layer) -> tuple[Layer, Table | None]:
        """Return a layer as it was made, with columns that were given, and its rows if any."""
        for made, table in self.layers.items():
            if made.name == declared.name:
                return made, table
        return declared, None


def product(kind: OutputKind, made: Any) -> Product:
    """Return what an algorithm made, with all that is worked out of it."""
    return _PRODUCTS[kind](made)


def _of_layout(made: Layout) -> Product:
    measured = MeasuredLayout(as_written(made))
    layout, tables = measured.layout, measured.tables

    def plot(path: Path) -> None:
        from urban_processing.report.map import plot_layout

        plot_layout(measured, path)

    return Product(
        crs=layout.frame.crs,
        layers={layer(name): table for name, table in tables.items()},
        history=_sentences(layout.history),
        summary=measured.summary(),
        broken=[check.message for check in measured.certificate.failures],
        write=partial(write_layout, layout, library=OGR, overwrite=True, tables=tables),
        plot=plot,
    )


def _of_layers(made: LayerSet) -> Product:
    def plot(path: Path) -> None:
        from urban_processing.report.layers_map import plot_layers

        plot_layers(made, path)

    return Product(
        crs=made.frame.crs,
        layers=made.layers(),
        history=_sentences(made.history),
        summary=made.summary,
        broken=(),
        write=partial(write_layer_set, made, library=OGR, overwrite=True),
        plot=plot,
    )


_PRODUCTS: Mapping[OutputKind, Callable[[Any], Product]] = {
    OutputKind.LAYOUT: _of_layout,
    OutputKind.LAYERS: _of_layers,
}


def _sentences(history: Sequence[Step]) -> list[str]:
    return [
        f"{step.algorithm} {step.version}, seed {step.seed}, input {step.input_sha256}, "
        f"parameters {json.dumps(dict(step.parameters), ensure_ascii=False)}"
        for step in history
    ]
