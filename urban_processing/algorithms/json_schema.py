"""JSON Schema of an algorithm's parameters, and the machine-readable description of it."""

from __future__ import annotations

import enum
from typing import Any

from urban_processing.algorithms.spec import AlgorithmSpec
from urban_processing.params.base import ParamField, Params

DIALECT = "https://json-schema.org/draft/2020-12/schema"
_TYPES = {bool: "boolean", int: "integer", float: "number", str: "string"}


def parameters_schema(params: type[Params]) -> dict[str, Any]:
    """Return the JSON Schema (2020-12) of a parameter class.

    Units, groups and readable labels, which the standard has no words for, stand under keys
    that begin with ``x-``; ``x-per-feature`` marks what a column of the main input may set.

    Examples
    --------
    >>> from urban_processing.params.cogenerate import CogenerateParams
    >>> parameters_schema(CogenerateParams)["properties"]["seed"]["minimum"]
    0
    """
    return {
        "$schema": DIALECT,
        "type": "object",
        "properties": {field.name: _property(field) for field in params.fields()},
        "additionalProperties": False,
    }


def description(spec: AlgorithmSpec) -> dict[str, Any]:
    """Return all that is declared about an algorithm as plain JSON types."""
    return {
        "name": spec.name,
        "title": spec.title,
        "group": spec.group,
        "summary": spec.summary,
        "description": spec.description,
        "inputs": [
            {
                "name": i.name,
                "kind": i.kind.value,
                "label": i.label,
                "help": i.help,
                "required": i.required,
            }
            for i in spec.inputs
        ],
        "outputs": [
            {
                "name": o.name,
                "kind": o.kind.value,
                "label": o.label,
                "help": o.help,
                "required": o.required,
            }
            | ({"of": o.of} if o.of else {})
            for o in spec.outputs
        ],
        "parameters": parameters_schema(spec.params),
        "references": list(spec.references),
    }


def _property(field: ParamField) -> dict[str, Any]:
    param = field.param
    out: dict[str, Any] = {"title": param.label, "description": param.help}
    if issubclass(field.kind, enum.Enum):
        choices: list[Any] = [member.value for member in field.kind]
        out["enum"] = [*choices, None] if field.optional else choices
    else:
        kind = _TYPES[field.kind]
        out["type"] = [kind, "null"] if field.optional else kind
    default = field.default
    out["default"] = default.value if isinstance(default, enum.Enum) else default
    limits = {
        "minimum": param.minimum,
        "exclusiveMinimum": param.above,
        "maximum": param.maximum,
        "x-unit": param.unit or None,
        "x-group": param.group or None,
        "x-advanced": param.advanced or None,
        "x-labels": dict(param.labels) or None,
        "x-per-feature": param.per_feature or None,
    }
    return out | {key: value for key, value in limits.items() if value is not None}
