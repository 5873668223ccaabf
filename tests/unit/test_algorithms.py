"""Algorithm specs, and what is made from them."""

from __future__ import annotations

import dataclasses
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import pytest
import shapely

from urban_processing.algorithms import (
    AlgorithmSpec,
    Input,
    InputKind,
    Output,
    OutputKind,
    get,
    specs,
)
from urban_processing.algorithms.json_schema import description, parameters_schema
from urban_processing.algorithms.reference import algorithm_page, layout_file_page
from urban_processing.algorithms.words import (
    column_in_words,
    default_in_words,
    kind_in_words,
    limits_in_words,
)
from urban_processing.cli.options import command_parameters
from urban_processing.errors import ParameterError
from urban_processing.layout import Layout
from urban_processing.metrics.registry import METRICS
from urban_processing.params import CogenerateParams, Param, Params, option_name
from urban_processing.progress import CallbackProgress
from urban_processing.schema import LAYERS
from urban_processing.site import Site

DOCS = Path(__file__).resolve().parents[2] / "docs"


@dataclass(frozen=True, kw_only=True)
class Small(Params):
    on: Annotated[bool, Param(help="On.", label="On")] = True
    name: Annotated[str | None, Param(help="Name.", label="Name", group="G", advanced=True)] = None
    size: Annotated[float, Param(help="Size.", label="Size", unit="m", above=0, maximum=9)] = 1.0


def test_names_are_stable_lowercase_and_unique() -> None:
    names = [spec.name for spec in specs()]
    assert len(set(names)) == len(names)
    assert all(name.isidentifier() and name == name.lower() for name in names)
    assert get("cogenerate") in specs()


def test_an_unknown_name_gets_a_hint() -> None:
    with pytest.raises(ParameterError, match="Did you mean cogenerate"):
        get("cogenrate")


def test_names_used_twice_are_refused() -> None:
    spec = get("cogenerate")
    twice = Input(name="parcels", kind=InputKind.LAYOUT, label="", help="")
    with pytest.raises(ValueError, match="parcels"):
        dataclasses.replace(spec, inputs=(*spec.inputs, twice))


def test_a_view_needs_its_output() -> None:
    spec = get("cogenerate")
    lost = Output(name="map", kind=OutputKind.MAP, label="", help="", of="nothing")
    with pytest.raises(ValueError, match="map"):
        dataclasses.replace(spec, outputs=(*spec.outputs, lost))


@pytest.mark.parametrize("spec", specs(), ids=lambda spec: spec.name)
def test_every_parameter_is_in_exactly_one_panel(spec: AlgorithmSpec) -> None:
    shown = [field.name for fields in spec.panels().values() for field in fields]
    assert sorted(shown) == sorted(field.name for field in spec.params.fields())
    assert all(field.param.advanced for field in spec.panels().get("Advanced", ()))


@pytest.mark.parametrize("spec", specs(), ids=lambda spec: spec.name)
def test_shells_show_the_same_names_defaults_and_limits(spec: AlgorithmSpec) -> None:
    schema = description(spec)["parameters"]["properties"]
    options = {option.name: option for option in command_parameters(spec)}
    page = algorithm_page(spec)
    fields = spec.params.fields()
    assert list(schema) == [field.name for field in fields]
    for field in fields:
        shown, option = schema[field.name], options[field.name]
        plain = field.default.value if hasattr(field.default, "value") else field.default
        assert shown["default"] == plain
        assert shown.get("minimum") == field.param.minimum
        assert shown.get("maximum") == field.param.maximum
        assert shown.get("exclusiveMinimum") == field.param.above
        assert shown["title"] == field.param.label
        assert shown["description"] == field.param.help
        assert f"--{option_name(field.name)}" in option.opts
        assert option.help == field.param.help
        assert limits_in_words(field) in option.note
        assert default_in_words(field) in option.note
        assert option.default is None  # one place for defaults: the parameter class
        assert column_in_words(field) in option.note
        assert shown.get("x-per-feature", False) is field.param.per_feature
        kind = ", ".join(filter(None, (kind_in_words(field), column_in_words(field))))
        assert f"`{field.name}` | {kind} | {limits_in_words(field)}" in page


def test_limits_are_said_in_words() -> None:
    field = {field.name: field for field in CogenerateParams.fields()}
    assert limits_in_words(field["candidates"]) == "4 to 200"
    assert limits_in_words(field["min_area"]) == "above 0"
    assert limits_in_words(field["parcels"]) == "at least 1"
    assert limits_in_words(field["pattern"]) == ""
    assert kind_in_words(field["pattern"]) == "loop, cul-de-sac or tree"
    assert kind_in_words(field["min_area"]) == "number in m²"
    assert default_in_words(field["min_area"]) == ""
    assert default_in_words(field["preset"]) == "recommended"


def test_json_schema_of_all_kinds_of_fields() -> None:
    properties = parameters_schema(Small)["properties"]
    assert properties["on"] == {
        "title": "On",
        "description": "On.",
        "type": "boolean",
        "default": True,
    }
    assert properties["name"] == {
        "title": "Name",
        "description": "Name.",
        "type": ["string", "null"],
        "default": None,
        "x-group": "G",
        "x-advanced": True,
    }
    assert properties["size"]["exclusiveMinimum"] == 0
    assert properties["size"]["maximum"] == 9
    assert properties["size"]["x-unit"] == "m"


def test_the_description_is_plain_json() -> None:
    described = description(get("cogenerate"))
    assert json.loads(json.dumps(described)) == described
    layers = ["corners", "streets", "obstacles", "locked", "rim_lines", "entries"]
    assert [i["name"] for i in described["inputs"]] == ["boundary", *layers]
    assert described["outputs"][1] == {
        "name": "plot",
        "kind": "map",
        "label": "Map",
        "help": "A map of the layout.",
        "required": False,
        "of": "output",
    }


def test_the_spec_runs_the_engine() -> None:
    spec = get("cogenerate")
    site = Site(parts=(shapely.box(0, 0, 120, 80),))
    params = spec.params.from_values({"parcels": 6})
    seen: list[float] = []
    progress = CallbackProgress(on_update=lambda fraction, _message: seen.append(fraction))
    made = spec.run({"boundary": site}, params, progress)
    assert set(made) == {output.name for output in spec.outputs if not output.of}
    layout: Any = made["output"]
    assert isinstance(layout, Layout)
    assert layout.mesh.n_faces == 6
    assert layout.history[-1].algorithm == spec.name
    assert seen == sorted(seen)
    assert seen[-1] == 1.0
    assert spec.estimate is not None
    estimate = spec.estimate({"boundary": site}, params)
    assert estimate.parcels == 6
    assert math.isfinite(estimate.seconds)
    assert estimate.seconds > 0


@pytest.mark.parametrize("spec", specs(), ids=lambda spec: spec.name)
def test_reference_pages_are_up_to_date(spec: AlgorithmSpec) -> None:
    if not DOCS.is_dir():
        pytest.skip("the docs folder is not beside these tests")
    hint = "run python docs/build.py"
    assert (DOCS / f"{spec.name}.md").read_text(encoding="utf-8") == algorithm_page(spec), hint
    assert (DOCS / "layout_file.md").read_text(encoding="utf-8") == layout_file_page(), hint


@pytest.mark.parametrize("spec", specs(), ids=lambda spec: spec.name)
def test_pages_list_the_columns_of_what_is_no_layout(spec: AlgorithmSpec) -> None:
    page = algorithm_page(spec)
    for output in spec.outputs:
        if output.kind is OutputKind.LAYOUT:
            assert "[layout_file.md](layout_file.md)" in page
            assert "### `" not in page
        for layer in output.layers if output.kind is OutputKind.LAYERS else ():
            _, found, after = page.partition(f"### `{layer.name}`\n")
            assert found
            table = after.partition("\n#")[0]
            assert ("Columns of the input follow" in table) is layer.open
            rows = [line.split(" | ")[0] for line in table.splitlines() if line.startswith("| `")]
            assert rows == [f"| `{column.name}`" for column in layer.columns]
            assert all(column.description in table for column in layer.columns)


def test_the_layout_file_page_has_every_layer_column_and_metric() -> None:
    page = layout_file_page()
    for layer in LAYERS:
        assert f"## `{layer.name}`" in page
        assert all(column.description in page for column in layer.columns)
    assert all(metric.definition in page for metric in METRICS)
