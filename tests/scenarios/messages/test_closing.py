"""The closing line: two sentences of a whole sip, and no peak of one that stopped."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from scenarios.messages.closing import closing_message
from scenarios.results.solution import Solution


@pytest.fixture
def whole(run_directory: Path) -> Solution:
    return Solution.load(run_directory)


def test_a_whole_sip_is_two_sentences(whole: Solution) -> None:
    said = closing_message(whole)
    assert said.startswith(
        "The whole motion was followed, from 1.00 to 2.00 s: the upper lip is pressed with up to "
        "60 kPa over half a millimetre (at 1.50 s), the lower lip is pressed with up to 20 kPa "
        "over half a millimetre (at 1.50 s). That is 22 % of the lowest pressure that hurt"
    )
    assert "the upper and the lower lip tell crests apart" in said
    assert said.count(". ") == 1
    for word in ("iteration", "cutback", "increment", "unstable"):
        assert word not in said


def test_what_to_mind_follows(whole: Solution) -> None:
    noted = replace(whole, summary={**whole.summary, "notes": ["the package was moved"]})
    assert closing_message(noted).splitlines()[1:] == ["note: the package was moved"]


def test_a_replay_that_stopped_states_no_peak(whole: Solution) -> None:
    stopped = replace(whole, summary={**whole.summary, "finished": False})
    said = closing_message(stopped)
    assert said.startswith("The replay stopped at 2.00 s")
    assert "kPa" not in said
    assert "%" not in said


def test_nothing_pressed_is_nothing_felt(whole: Solution) -> None:
    none = {f"{lip}_lip_window_kpa": 0.0 for lip in ("upper", "lower")}
    said = closing_message(replace(whole, summary={**whole.summary, **none}))
    assert "never pressed a lip" in said
