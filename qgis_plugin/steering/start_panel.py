"""The first panel: what a session begins with."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from qgis.core import (
    QgsMapLayerProxyModel,
    QgsProcessingFeatureSourceDefinition,
    QgsVectorLayer,
)
from qgis.gui import QgsCollapsibleGroupBox, QgsFileWidget, QgsMapLayerComboBox
from qgis.PyQt.QtCore import pyqtSignal
from qgis.PyQt.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDoubleSpinBox,
    QFileDialog,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QRadioButton,
    QVBoxLayout,
    QWidget,
)

from qgis_plugin.definitions import input_of, parameter_name
from qgis_plugin.steering.model import Start
from qgis_plugin.steering.widgets import allow, button, tipped
from qgis_plugin.texts import tr
from urban_processing.algorithms import InputKind
from urban_processing.algorithms.cogenerate import COGENERATE
from urban_processing.params import ParamField

SESSIONS = "Steering session (*.json)"
LAYOUT_FILES = "Layout file (*.gpkg)"

_FURTHER = {
    InputKind.FIXED_STREETS: QgsMapLayerProxyModel.Filter.LineLayer,
    InputKind.OBSTACLES: QgsMapLayerProxyModel.Filter.PolygonLayer,
    InputKind.LOCKED_LAND: QgsMapLayerProxyModel.Filter.PolygonLayer,
}
"""Layers beside the land that may be given, and what they are made of."""

_MIN_AREA, _PARCELS, _PATTERN = "min_area", "parcels", "pattern"
_FIRST_SIZES = {_MIN_AREA: 800.0, _PARCELS: 500.0}


class StartPanel(QWidget):
    """Asks for land or a layout file, and for the size of parcels."""

    begin_asked = pyqtSignal(object)
    """A new session: `Start`."""

    open_asked = pyqtSignal(object, object)
    """A saved session: its path, and the `Start` that it began with."""

    def __init__(self) -> None:
        super().__init__()
        fields = {field.name: field for field in COGENERATE.params.fields()}
        self.on_land = QRadioButton(tr("A layer of land"))
        self.on_file = QRadioButton(tr("A layout file"))
        self.on_land.setChecked(True)
        self.land = tipped(
            QgsMapLayerComboBox(), tr("The land: polygons, in any coordinate system.")
        )
        self.land.setFilters(QgsMapLayerProxyModel.Filter.PolygonLayer)
        self.selected = tipped(
            QCheckBox(tr("Selected features only")), tr("Lay out the selected polygons alone.")
        )
        self.file = QgsFileWidget()
        self.file.setFilter(LAYOUT_FILES)
        self.size_kind, self.size = _size_boxes(fields)
        self.pattern = _choice(fields[_PATTERN])
        self.further = {kind: _layer_box(filters) for kind, filters in _FURTHER.items()}
        self.begin = button(
            tr("Begin"),
            tr("Begin with the land as one parcel; nothing is cut yet."),
            "mActionStart",
        )
        self.open = button(
            tr("Open session…"),
            tr("Open a saved session, and do its edits again on what is chosen above."),
            "mActionFileOpen",
        )
        self._land_form, self._file_form = QWidget(), QWidget()
        self._lay_out()
        self._connect()
        self.update_state()

    def update_state(self, reason: str = "") -> None:
        """Enable what can be used; `reason` says why nothing can."""
        land = self.on_land.isChecked()
        self._land_form.setVisible(land)
        self._file_form.setVisible(not land)
        layer = self.land.currentLayer()
        selected = isinstance(layer, QgsVectorLayer) and layer.selectedFeatureCount() > 0
        allow(self.selected, "" if selected else tr("No feature of this layer is selected."))
        if not reason and land and layer is None:
            reason = tr("Load a layer of polygons first, and choose it above.")
        if not reason and not land and not self.file.filePath():
            reason = tr("Choose a layout file above.")
        allow(self.begin, reason)
        allow(self.open, reason)

    def start(self) -> Start:
        """Return what was chosen."""
        if self.on_file.isChecked():
            path = self.file.filePath()
            return Start(layout_file=path, name=Path(path).stem)
        layer = self.land.currentLayer()
        layers: dict[str, Any] = {"BOUNDARY": self._source(layer)}
        for kind, box in self.further.items():
            item = input_of(COGENERATE, kind)
            if item is not None and box.currentLayer() is not None:
                layers[parameter_name(item.name)] = _all_of(box.currentLayer())
        size = self.size.value()
        kind = self.size_kind.currentData()
        values = {
            kind: int(size) if kind == _PARCELS else size,
            _PATTERN: self.pattern.currentData(),
        }
        return Start(layers=layers, values=values, name=layer.name())

    def _source(self, layer: QgsVectorLayer) -> QgsProcessingFeatureSourceDefinition:
        if self.selected.isEnabled() and self.selected.isChecked():
            return QgsProcessingFeatureSourceDefinition(layer.id(), True)
        return _all_of(layer)

    def _lay_out(self) -> None:
        form = QFormLayout(self._land_form)
        form.setContentsMargins(18, 0, 0, 0)
        form.addRow(self.land)
        form.addRow(self.selected)
        sizes = QHBoxLayout()
        sizes.addWidget(self.size_kind, 1)
        sizes.addWidget(self.size, 1)
        form.addRow(sizes)
        form.addRow(tr("Streets"), self.pattern)
        group = QgsCollapsibleGroupBox(tr("What is there already (optional)"))
        group.setCollapsed(True)
        inner = QFormLayout(group)
        for kind, box in self.further.items():
            item = input_of(COGENERATE, kind)
            if item is not None:
                tipped(box, tr(item.help))
                inner.addRow(tr(item.label), box)
        form.addRow(group)
        file_form = QVBoxLayout(self._file_form)
        file_form.setContentsMargins(18, 0, 0, 0)
        file_form.addWidget(self.file)
        hint = QLabel(tr("A GeoPackage of Co-generate, finished or stopped at a level."))
        hint.setWordWrap(True)
        file_form.addWidget(hint)
        whole = QVBoxLayout(self)
        whole.addWidget(QLabel(f"<b>{tr('Start from')}</b>"))
        for widget in (self.on_land, self._land_form, self.on_file, self._file_form):
            whole.addWidget(widget)
        buttons = QHBoxLayout()
        buttons.addWidget(self.begin)
        buttons.addWidget(self.open)
        whole.addLayout(buttons)
        whole.addStretch(1)

    def _connect(self) -> None:
        self.on_land.toggled.connect(lambda _: self.update_state())
        self.land.layerChanged.connect(self._watch_selection)
        self.file.fileChanged.connect(lambda _: self.update_state())
        self.size_kind.currentIndexChanged.connect(lambda _: self._show_size())
        self.begin.clicked.connect(lambda: self.begin_asked.emit(self.start()))
        self.open.clicked.connect(self._ask_for_session)
        self._watch_selection(self.land.currentLayer())
        self._show_size()

    def _watch_selection(self, layer: QgsVectorLayer | None) -> None:
        if isinstance(layer, QgsVectorLayer):
            layer.selectionChanged.connect(self._selection_changed)
        self.update_state()

    def _selection_changed(self, *_: Any) -> None:
        self.update_state()

    def _show_size(self) -> None:
        name = self.size_kind.currentData()
        self.size.setDecimals(0 if name == _PARCELS else 1)
        self.size.setSuffix("" if name == _PARCELS else " m²")
        self.size.setValue(_FIRST_SIZES[name])

    def _ask_for_session(self) -> None:
        path, _ = QFileDialog.getOpenFileName(self, tr("Open session"), "", SESSIONS)
        if path:
            self.open_asked.emit(Path(path), self.start())


def _size_boxes(fields: dict[str, ParamField]) -> tuple[QComboBox, QDoubleSpinBox]:
    kinds = QComboBox()
    for name in (_MIN_AREA, _PARCELS):
        kinds.addItem(tr(fields[name].param.label), name)
    size = tipped(
        QDoubleSpinBox(), tr("How small the smallest parcel may be, or how many to make.")
    )
    size.setRange(1, 1e9)
    size.setGroupSeparatorShown(True)
    return kinds, size


def _choice(field: ParamField) -> QComboBox:
    """Return a box with the values of a parameter."""
    box = tipped(QComboBox(), tr(field.param.help))
    for member in field.kind:  # type: ignore[attr-defined]
        box.addItem(tr(field.param.labels.get(member.value, member.value)), member.value)
    box.setCurrentIndex(box.findData(field.default.value))
    return box


def _layer_box(filters: Any) -> QgsMapLayerComboBox:
    box = QgsMapLayerComboBox()
    box.setAllowEmptyLayer(True)
    box.setFilters(filters)
    box.setLayer(None)
    return box


def _all_of(layer: QgsVectorLayer) -> QgsProcessingFeatureSourceDefinition:
    return QgsProcessingFeatureSourceDefinition(layer.id(), False)
