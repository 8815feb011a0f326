"""Runs that tests look at."""

from __future__ import annotations

from pathlib import Path

import pytest

from scenarios.results.increment import Increment, SectionModel
from scenarios.results.writer import SolutionWriter
from tests.support.made_up_sip import (
    COUNT,
    small_increment,
    small_model,
    write_motion,
    write_small_recording,
)


@pytest.fixture(scope="session")
def model() -> SectionModel:
    return small_model()


@pytest.fixture(scope="session")
def increments(model: SectionModel) -> list[Increment]:
    return [small_increment(model, index, COUNT) for index in range(COUNT)]


@pytest.fixture(scope="session")
def run_directory(
    tmp_path_factory: pytest.TempPathFactory, model: SectionModel, increments: list[Increment]
) -> Path:
    """A finished run with a recording."""
    place = tmp_path_factory.mktemp("runs")
    write_small_recording(place / "filmed")
    scenario = (
        'name = "made up"\n'
        f'[recording]\nvideo = "{place}/filmed/recording.mp4"\n'
        f'markers = "{place}/filmed/markers.toml"\n'
        '[motion]\nfile = "motion/motion.csv"\n'
    )
    writer = SolutionWriter(place / "run", scenario, resume=False)
    write_motion(writer.folder / "motion", tracked=True)
    writer.model(model)
    for increment in increments:
        writer.commit(increment)
    writer.finish(finished=True, message="all of it", about={"scenario": "made up"})
    return place / "run"
