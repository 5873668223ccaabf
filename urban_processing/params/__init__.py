"""Declared parameters of the algorithms."""

from urban_processing.params.base import Naming, Param, ParamField, Params, option_name
from urban_processing.params.cogenerate import CogenerateParams, StreetPattern
from urban_processing.params.optimize import Energy, OptimizeParams
from urban_processing.params.rules import Preset

__all__ = [
    "CogenerateParams",
    "Energy",
    "Naming",
    "OptimizeParams",
    "Param",
    "ParamField",
    "Params",
    "Preset",
    "StreetPattern",
    "option_name",
]
