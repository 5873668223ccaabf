"""Measures of a layout, its tables, and the certificate that it is what was promised."""

from urban_processing.metrics.certificate import Certificate, Check, certificate, certify
from urban_processing.metrics.measured import MeasuredLayout
from urban_processing.metrics.measures import LayoutMeasures, Metric, measure
from urban_processing.metrics.parcels import ParcelMeasures, measure_parcels
from urban_processing.metrics.tables import layout_tables
from urban_processing.tables import Table

__all__ = [
    "Certificate",
    "Check",
    "LayoutMeasures",
    "MeasuredLayout",
    "Metric",
    "ParcelMeasures",
    "Table",
    "certificate",
    "certify",
    "layout_tables",
    "measure",
    "measure_parcels",
]
