"""Figures and remarks of a provenance, which may have any content."""

import dataclasses
from typing import Any

import pytest

from mplicits.model.remarks import remarks
from mplicits.model.surface_figures import SurfaceFigures, SurfaceRecord, invented_line, surface_record

NEAR = SurfaceFigures(1e-4, 3e-4, 2.5, 0.01)
STAGE = {"steps": 62, "steps_planned": 1400, "step_seconds": 0.05}


@pytest.mark.parametrize(
    "provenance",
    [
        {},
        {"surface": 3, "levels": 3, "settings": 3, "seconds": "x"},
        {"surface": {"shape": {"missing_mean": "x"}, "flat": 4}},
        {"surface": {"shape": {"missing_mean": 1e300, "normal_angle": 1.0}}},
        {"settings": {"seconds": 60.0}, "seconds": 61.0, "levels": [3, {}, STAGE | {"steps": 10**400}]},
        {"settings": {"seconds": 60.0}, "seconds": 61.0, "levels": [STAGE | {"step_seconds": 1e300}]},
        {"settings": {"seconds": 10**400}, "seconds": 61.0, "levels": [STAGE]},
    ],
)
def test_any_provenance_is_read(provenance: dict[str, Any]) -> None:
    assert surface_record(provenance) is None
    assert remarks(provenance) == []


def test_a_record_is_read_as_it_was_written() -> None:
    record = SurfaceRecord(NEAR, dataclasses.replace(NEAR, distance_mean=None, invented=None), open=True)
    assert surface_record({"surface": record.to_json()}) == record


def test_the_distance_is_the_mean_of_both_directions() -> None:
    assert NEAR.distance == pytest.approx(2e-4)
    assert NEAR.told() == "2.00e-04 (mean of both directions), normals by 2.50 degrees"
    assert dataclasses.replace(NEAR, distance_mean=None).told().startswith("3.00e-04 (mean of one direction)")


@pytest.mark.parametrize(
    ("changed", "told"), [({}, 1), ({"normal_angle": 3.5}, 1), ({"normal_angle": 4.0}, 2), ({"missing_mean": 6e-4}, 2)]
)
def test_flat_faces_are_told_from_a_ratio_of_one_and_a_half(changed: dict[str, float], told: int) -> None:
    assert len(SurfaceRecord(NEAR, dataclasses.replace(NEAR, **changed), open=False).told()) == told


def test_invented_surface_is_told_with_its_remedy() -> None:
    assert invented_line(None, open_mesh=True) == invented_line(0.03, open_mesh=True) == ""
    assert "42% of the model's surface" in invented_line(0.42, open_mesh=True)
    assert "--thicken" in invented_line(0.42, open_mesh=True)
    assert "--thicken" not in invented_line(0.42, open_mesh=False)


def test_few_steps_are_told_unless_the_training_was_interrupted() -> None:
    whole = {"steps": 900, "steps_planned": 950, "step_seconds": 0.01}
    provenance = {"settings": {"seconds": 60.0}, "seconds": 75.0, "levels": [whole, STAGE], "texture": whole}
    (line,) = remarks(provenance)
    assert line.startswith("level 2 took 62 steps of some 1,400: ")
    assert "--seconds 150" in line, "75 s, and 1,338 steps of 0.05 s, in two digits"
    assert remarks(provenance | {"interrupted": True}) == []
    assert remarks(provenance | {"levels": [whole, STAGE | {"steps": 700}]}) == []
    rough = {"steps": 300, "steps_planned": 310, "step_seconds": 0.01}
    assert "level 1 took 300 steps of some 800" in remarks(provenance | {"levels": [rough]})[0]
