"""Where outputs go: the checks before a run, and the writing after it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from urban_processing.algorithms.spec import Output, OutputKind
from urban_processing.errors import ParameterError
from urban_processing.params.export import ExportParams


def problems(output: Output, whole: Output, given: Mapping[str, Any]) -> list[str]:
    """Return one sentence for each reason why an output cannot be written where it is to go.

    `whole` is what it is a view of, or the output itself.
    """
    path, overwrite = Path(given[output.name]), given["overwrite"]
    if output.kind.is_geopackage:
        from urban_processing.layout_file.writing import check_output

        return check_output(path, overwrite=overwrite)
    if output.kind.endings:
        from urban_processing.paths import ending_problems, replaced_problems

        wrong = ending_problems(path, output.kind.value, output.kind.endings)
        return [*wrong, *replaced_problems(path, overwrite=overwrite)]
    from urban_processing.io.exports import check_export

    kind = _kind(output, given)
    try:
        return check_export(path, kind=kind, overwrite=overwrite, layers=whole.layers)
    except ParameterError as error:
        # a parameter is checked with the others
        return list(error.problems) if output.of else []


def write(output: Output, made: Any, given: Mapping[str, Any]) -> Path:
    """Write an output and return where it is."""
    path, overwrite = Path(given[output.name]), given["overwrite"]
    if output.kind is OutputKind.LAYOUT:
        from urban_processing.io.files import write_layout

        return write_layout(made, path, overwrite=overwrite, record_seconds=given["record_seconds"])
    if output.kind is OutputKind.LAYERS:
        from urban_processing.io.files import write_layers

        return write_layers(made, path, overwrite=overwrite, record_seconds=given["record_seconds"])
    if output.kind is OutputKind.MAP:
        _plot(made, path)
        return path
    if output.kind in (OutputKind.REPORT, OutputKind.JSON, OutputKind.CSV):
        from urban_processing.report.html import write as write_report

        return write_report(made, path, overwrite=overwrite)  # in the format of its ending
    from urban_processing.io.exports import export_layers, export_layout
    from urban_processing.tables import LayerSet

    how = {"kind": _kind(output, given), "overwrite": overwrite}
    if isinstance(made, LayerSet):
        return export_layers(made.layers(), path, crs=made.frame.crs, **how)
    return export_layout(made, path, **how)


def _plot(made: Any, path: Path) -> None:
    from urban_processing.tables import LayerSet

    if isinstance(made, LayerSet):
        from urban_processing.report.layers_map import plot_layers

        plot_layers(made, path)
    else:
        from urban_processing.report.map import plot_layout

        plot_layout(made, path)


def _kind(output: Output, given: Mapping[str, Any]) -> str:
    """Format of plain files: of a view an option of its own, else a parameter."""
    name = f"{output.name}_format" if output.of else "format"
    return str(given[name] or ExportParams.format)
