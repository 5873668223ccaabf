"""The CRS of what was given, and the one that it is worked with in."""

from __future__ import annotations

from typing import TypeVar

from urban_processing.intake.crs_choice import CrsLibrary, choose_crs, crs_label
from urban_processing.intake.features import Features
from urban_processing.site import FloatArray, Issue

C = TypeVar("C")


def source_crs(
    features: Features[C],
    asked: C | None,
    library: CrsLibrary[C],
    problems: list[str],
    issues: list[Issue],
) -> C | None:
    """CRS of the source's coordinates: its own, else the one asked for."""
    if features.crs is not None:
        if asked is not None and not library.facts(asked).metric:
            problems.append(
                f"crs must be projected and in metres; {crs_label(asked, library)} is not. "
                "Choose for example the UTM zone, or leave crs out."
            )
        return features.crs
    if asked is not None:
        if not features.bare:
            message = f"{features.name} has no CRS; {crs_label(asked, library)} was taken for it."
            issues.append(Issue("crs_assumed", message))
        return asked
    if not features.bare and not problems:
        problems.append(
            f"{features.name} has no CRS. Give it with crs (--crs EPSG:code), or assign it in "
            "the data: GeoDataFrame.set_crs, or Assign Projection in QGIS."
        )
    return None


def working_crs(
    xy: FloatArray,
    own: C | None,
    asked: C | None,
    library: CrsLibrary[C],
    issues: list[Issue],
    *,
    what: str = "The boundary is",
    result: str = "the layout is",
) -> C | None:
    """CRS to work in: the one asked for if it is metric, else the best one at some places.

    Parameters
    ----------
    xy
        (n, 2) coordinates of the source, in its `own` CRS.
    own, asked
        CRS of the source and CRS asked for; None where there is none.
    library
        What knows the CRSs.
    issues
        Is told if the CRS is not the source's own.
    what, result
        What the source and the result are called in sentences, with their verb.
    """
    if own is None:
        return None
    if asked is not None and library.facts(asked).metric:
        return asked
    chosen = choose_crs(own, xy, library)
    if chosen.reason:
        issues.append(
            Issue(
                "crs_changed",
                f"{what} in {crs_label(own, library)}, but {chosen.reason}: {result} in "
                f"{crs_label(chosen.crs, library)}.",
            )
        )
    return chosen.crs
