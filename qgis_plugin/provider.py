"""The provider: all algorithms of the registry that make layers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from qgis.core import QgsProcessingProvider
from qgis.PyQt.QtGui import QIcon

from qgis_plugin.algorithm import SpecAlgorithm
from qgis_plugin.definitions import is_offered
from qgis_plugin.plugin import ICON, TITLE
from urban_processing.algorithms import AlgorithmSpec, specs
from urban_processing.version import __version__

if TYPE_CHECKING:
    from qgis_plugin.styling import ResultStyle


class UrbanProcessingProvider(QgsProcessingProvider):
    """Offers algorithms to the Processing toolbox.

    Parameters
    ----------
    algorithms
        Their declarations.
    """

    def __init__(self, algorithms: tuple[AlgorithmSpec, ...] = specs()) -> None:
        super().__init__()
        self.algorithm_specs = algorithms
        self.styles: list[ResultStyle] = []
        """Styles on their way to layers: QGIS does not keep them alive, and the algorithm that
        made them may be gone when their layers are loaded."""

    def id(self) -> str:
        """Return what stands before the colon of an algorithm's name; never to be changed."""
        return "urban_processing"

    def name(self) -> str:
        """Return what the toolbox shows."""
        return TITLE

    def longName(self) -> str:
        """Return the name with the version."""
        return f"{TITLE} {__version__}"

    def versionInfo(self) -> str:
        """Return the version."""
        return __version__

    def icon(self) -> QIcon:
        """Return the picture beside the name."""
        return QIcon(str(ICON))

    def loadAlgorithms(self) -> None:
        """Add every algorithm that makes layers."""
        for spec in filter(is_offered, self.algorithm_specs):
            self.addAlgorithm(SpecAlgorithm(spec))
