"""The file from which a sip goes on of which only the history is kept."""

from dataclasses import replace

import numpy as np

from scenarios.campaign.history_checkpoint import HistoryCheckpoint
from scenarios.results.history_file import COLUMNS


def with_state(increment, number):
    return replace(increment, checkpoint={"displacement": np.full((3, 2), float(number))})


def test_rows_and_the_last_state_are_read_back(tmp_path, increments):
    file = tmp_path / "checkpoint.npz"
    kept = HistoryCheckpoint(file, every_s=0.0)
    assert kept.last is None
    for number, increment in enumerate(increments):
        kept.commit(with_state(increment, number))
    again = HistoryCheckpoint(file)
    assert again.last.time_s == increments[-1].time_s
    assert np.array_equal(again.last.checkpoint["displacement"], np.full((3, 2), 10.0))
    assert set(again.history) == set(COLUMNS)
    for name in COLUMNS:
        assert np.array_equal(again.history[name], kept.history[name])


def test_it_is_written_every_few_seconds_only(tmp_path, increments):
    file = tmp_path / "checkpoint.npz"
    kept = HistoryCheckpoint(file, every_s=1e9)
    for increment in increments:
        kept.commit(increment)
    assert not file.exists()
    assert kept.history["time_s"].size == len(increments)


def test_a_damaged_file_is_not_gone_on_with(tmp_path, increments):
    file = tmp_path / "checkpoint.npz"
    HistoryCheckpoint(file, every_s=0.0).commit(increments[0])
    file.write_bytes(file.read_bytes()[:-40])
    again = HistoryCheckpoint(file)
    assert again.last is None
    assert again.history["time_s"].size == 0
