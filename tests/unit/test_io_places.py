"""Boundaries by the name of a place, with the geocoder's answers made up."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import requests

from urban_processing.errors import BoundaryError, DependencyError
from urban_processing.io.boundaries import read_boundary
from urban_processing.io.places import default_cache_folder, fetch_place

ANSWER: dict[str, Any] = {
    "place_id": 1,
    "licence": "Data © OpenStreetMap contributors, ODbL 1.0",
    "osm_type": "relation",
    "osm_id": 2,
    "lat": "47.2",
    "lon": "9.5",
    "class": "boundary",
    "type": "administrative",
    "place_rank": 16,
    "importance": 0.4,
    "addresstype": "village",
    "name": "Testing",
    "display_name": "Testing, Liechtenstein",
    "boundingbox": ["47.19", "47.21", "9.49", "9.51"],
    "geojson": {
        "type": "Polygon",
        "coordinates": [
            [[9.49, 47.19], [9.51, 47.19], [9.51, 47.21], [9.49, 47.21], [9.49, 47.19]]
        ],
    },
}


def answer(monkeypatch: pytest.MonkeyPatch, results: list[dict[str, Any]]) -> list[str]:
    """Make the geocoder give `results`; returns the list of addresses that were asked."""
    asked: list[str] = []

    def get(url: str, **kwargs: Any) -> requests.Response:
        asked.append(url)
        response = requests.Response()
        response.status_code, response.url = 200, url
        response._content = json.dumps(results).encode()
        return response

    monkeypatch.setattr(requests, "get", get)
    monkeypatch.setattr("time.sleep", lambda seconds: None)
    return asked


def test_place_is_fetched_once_and_then_cached(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    import osmnx

    before = dict(vars(osmnx.settings))
    asked = answer(monkeypatch, [ANSWER])
    first = fetch_place("Testing", cache_folder=tmp_path / "cache")
    second = fetch_place("Testing", cache_folder=tmp_path / "cache")
    assert len(asked) == 1
    assert first.crs == second.crs == "EPSG:4326"
    assert read_boundary(second).frame.crs == "EPSG:32632"
    assert dict(vars(osmnx.settings)) == before


def test_no_network_is_one_sentence(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def get(url: str, **kwargs: Any) -> requests.Response:
        raise requests.exceptions.ConnectionError("no route")

    monkeypatch.setattr(requests, "get", get)
    monkeypatch.setattr("time.sleep", lambda seconds: None)
    with pytest.raises(DependencyError) as caught:
        fetch_place("Testing", cache_folder=tmp_path)
    (sentence,) = caught.value.problems
    assert "cannot be reached" in sentence
    assert "'Testing'" in sentence


def test_unknown_place_and_point(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    answer(monkeypatch, [])
    with pytest.raises(BoundaryError, match="no place 'Nowhere'"):
        fetch_place("Nowhere", cache_folder=tmp_path)
    answer(monkeypatch, [ANSWER | {"geojson": {"type": "Point", "coordinates": [9.5, 47.2]}}])
    with pytest.raises(BoundaryError, match="only as a point"):
        fetch_place("Testing", cache_folder=tmp_path)
    with pytest.raises(BoundaryError, match="empty"):
        fetch_place(" ")


def test_cache_folder_follows_the_system(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert default_cache_folder() == tmp_path / "urban_processing" / "places"
