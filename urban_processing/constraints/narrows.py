"""What is narrow: inlets, spurs, and strips of land."""

from __future__ import annotations

import shapely

MITRE_LIMIT = 5.0
NARROW_AREA = 0.2
"""Narrow pieces smaller than this many squared widths stay as they are."""

HAIR = 1e-3
"""Widening, in widths, of what is filled or taken off, so that no slits stay."""


def there_and_back(polygon: shapely.Polygon, reach: float) -> shapely.Geometry:
    """Widen a polygon by `reach` metres and narrow it again, or the reverse if that is negative.

    Inlets narrower than twice the reach are filled then, or spurs cut off.
    """
    there = shapely.buffer(polygon, reach, join_style="mitre", mitre_limit=MITRE_LIMIT)
    return shapely.buffer(there, -reach, join_style="mitre", mitre_limit=MITRE_LIMIT)
