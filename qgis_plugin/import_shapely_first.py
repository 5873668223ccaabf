"""For PYQGIS_STARTUP: import shapely before QGIS does, so that it uses its own GEOS.

QGIS from 3.40 on imports shapely when it starts, if it finds it; on Linux a wheel of it is then
bound to the GEOS of QGIS and does not work. See `dependencies`.
"""

import contextlib
import os
import sys

if sys.platform.startswith("linux"):
    flags = sys.getdlopenflags()
    sys.setdlopenflags(os.RTLD_NOW | os.RTLD_LOCAL | os.RTLD_DEEPBIND)
    try:
        with contextlib.suppress(ImportError):
            import shapely  # noqa: F401
    finally:
        sys.setdlopenflags(flags)
