"""The report of one layout, or of several side by side: a page, and files for machines."""

from urban_processing.report.html.machine import report_csv, report_json
from urban_processing.report.html.model import Report, ReportSide, report_side
from urban_processing.report.html.page import report_html
from urban_processing.report.html.writing import (
    report_problems,
    write,
    write_csv,
    write_json,
    write_report,
)

__all__ = [
    "Report",
    "ReportSide",
    "report_csv",
    "report_html",
    "report_json",
    "report_problems",
    "report_side",
    "write",
    "write_csv",
    "write_json",
    "write_report",
]
