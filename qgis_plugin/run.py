"""One run of an algorithm in QGIS; the engine is imported here, not before."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from qgis.core import QgsProcessingFeedback

from qgis_plugin.crs_text import crs_of
from qgis_plugin.definitions import SinkName
from qgis_plugin.destinations import Destinations
from qgis_plugin.feedback import in_qgis
from qgis_plugin.products import Product, product
from qgis_plugin.results import write_sink
from qgis_plugin.sources import Sources
from qgis_plugin.styling import ResultGroup
from urban_processing.algorithms import AlgorithmSpec
from urban_processing.algorithms.words import estimate_in_words
from urban_processing.params import Params
from urban_processing.progress import MANY_PARCELS, Progress

if TYPE_CHECKING:
    from qgis_plugin.algorithm import SpecAlgorithm

_COMPUTING = 0.9
"""Share of the progress bar for the engine; measuring and writing take the rest."""


def run(
    algorithm: SpecAlgorithm,
    params: Params,
    destinations: Destinations,
    progress: Progress,
    feedback: QgsProcessingFeedback,
) -> dict[str, Any]:
    """Read the inputs, run the engine, write files and sinks, and say what was made.

    Nothing is written before everything has been worked out, so that a run that is cancelled
    leaves nothing. Files come before layers: where one cannot be written there are no layers.

    Returns
    -------
    dict
        Ids of layers and paths of files by parameter, as QGIS wants them.
    """
    spec = algorithm.spec
    sources = Sources(algorithm, destinations.parameters, destinations.context, feedback, params)
    inputs = sources.read()
    _say_what_inputs_say(spec, inputs, feedback)
    if spec.estimate is not None:
        estimate = spec.estimate(inputs, params)
        say = feedback.pushWarning if estimate.parcels > MANY_PARCELS else feedback.pushInfo
        say(f"Expected: {estimate_in_words(estimate)}.")
    made = spec.run(inputs, params, progress.slice(0.0, _COMPUTING))
    progress.update(_COMPUTING, "Measuring the results")
    products = {
        output.name: product(output.kind, made[output.name])
        for output in spec.outputs
        if output.kind.is_geopackage
    }
    # the last moment at which a run can be cancelled: what is written from here on stays
    progress.update(0.95, "Writing the results")
    results: dict[str, Any] = {}
    for name, (output, path) in destinations.files.items():
        of = output.of or output.name
        if of in products:
            whole = products[of]
            (whole.write if output.kind.is_geopackage else whole.plot)(path)
        else:
            from urban_processing.report.html import write as write_report

            write_report(made[of], path, overwrite=True)  # in the format of its ending
        results[name] = str(path)
    title = result_title(sources.name, spec, params)
    results.update(write_sinks(products, destinations, title))
    for whole in products.values():
        for name, value in whole.summary:
            feedback.pushInfo(f"{name}: {value}")
    broken = [message for whole in products.values() for message in whole.broken]
    if broken:
        feedback.reportError(
            "The layout was made, but not all that it promises holds:\n" + "\n".join(broken)
        )
    return results


def write_sinks(
    products: Mapping[str, Product], destinations: Destinations, title: str
) -> dict[str, str]:
    """Write the layers that were asked for, in one group for each output, and return their ids.

    Parameters
    ----------
    products
        What was made, by output.
    destinations
        Where it goes.
    title
        Name of the groups.
    """
    groups = {name: ResultGroup(title, whole.history) for name, whole in products.items()}
    results = {}
    for sink in destinations.sinks:
        whole = products[sink.output.name]
        made_of, table = whole.layer(sink.layer)
        results[sink.parameter] = write_sink(
            SinkName(sink.output, made_of),
            table,
            destinations,
            crs=whole.crs,
            group=groups[sink.output.name],
        )
    return results


def _say_what_inputs_say(
    spec: AlgorithmSpec, inputs: Mapping[str, Any], feedback: QgsProcessingFeedback
) -> None:
    """Say which CRS is worked in, and what was repaired or changed in reading the inputs."""
    for item in spec.inputs:
        read = inputs.get(item.name)
        if item.kind.is_ground and read is not None:
            for issue in read.issues:
                feedback.pushInfo(in_qgis(issue.message))
            crs = crs_of(read.frame.crs)
            feedback.pushInfo(f"CRS of the results: {crs.userFriendlyIdentifier()}.")


def result_title(land: str, spec: AlgorithmSpec, params: Params) -> str:
    """Return the name of the group of results: land, algorithm and seed."""
    seed = params.as_dict().get("seed")
    words = [land, spec.name, "" if seed is None else f"seed {seed}"]
    return ", ".join(filter(None, words))
