"""An interrupted replay goes on as if it had not been interrupted, in fields and in words."""

from collections.abc import Callable
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from scenarios.results.increment import Increment
from scenarios.settings.scenario import Scenario, load_scenario
from scenarios.sip.replay import Outcome, replay

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module", params=["coarse", "quick"])
def scenario(library_motion: Callable[[str], Path], request: pytest.FixtureRequest) -> Scenario:
    filmed = load_scenario("A38-F", [f"numerics.resolution={request.param}"])
    return filmed.with_motion(library_motion("A38-F"))


def stopped(
    scenario: Scenario, *, after: int, resume_from: Increment | None = None
) -> tuple[list[Increment], Outcome]:
    """Replay so many increments."""
    increments: list[Increment] = []

    def commit(increment: Increment) -> None:
        increments.append(increment)
        if len(increments) == after:
            raise KeyboardInterrupt

    return increments, replay(scenario, on_increment=commit, resume_from=resume_from)


def test_resumed_replay_gives_the_same_bits_and_the_same_summary(scenario: Scenario):
    whole, outcome = stopped(scenario, after=40)
    first, _ = stopped(scenario, after=28)
    rest, resumed = stopped(scenario, after=12, resume_from=first[-1])
    assert len(rest) == 12
    for one, other in zip(whole, [*first, *rest], strict=True):
        assert one.time_s == other.time_s
        assert one.history == other.history
        np.testing.assert_array_equal(one.displacement, other.displacement)
        assert one.checkpoint.keys() == other.checkpoint.keys()
        for name, values in one.checkpoint.items():
            np.testing.assert_array_equal(values, other.checkpoint[name], err_msg=name)
        for lip, contact in one.contact.items():
            for item in fields(contact):
                np.testing.assert_array_equal(
                    getattr(contact, item.name), getattr(other.contact[lip], item.name)
                )
    assert outcome.about == resumed.about
    # The deepest penetration so far came before the interruption in at least one of the pairs.
    assert outcome.about["largest_penetration_neck_mm"] > 0
    assert f"since it was resumed at {first[-1].time_s:.3f} s" in resumed.message
    assert "resumed" not in outcome.message
