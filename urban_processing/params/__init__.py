"""Declared parameters of the algorithms."""

from urban_processing.params.base import Naming, Param, ParamField, Params, option_name
from urban_processing.params.cogenerate import CogenerateParams, Preset, StreetPattern

__all__ = [
    "CogenerateParams",
    "Naming",
    "Param",
    "ParamField",
    "Params",
    "Preset",
    "StreetPattern",
    "option_name",
]
