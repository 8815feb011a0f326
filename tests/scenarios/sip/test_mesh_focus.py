"""The mesh is finest where the neck comes near the lips."""

from __future__ import annotations

import numpy as np
import pytest

from geometry2d.anatomy.head import head_section
from geometry2d.mesh import section_mesh
from geometry2d.neck import NECKS, NeckSection, neck_section
from geometry2d.rigid import RigidMotion
from scenarios.settings.numerics import QUICK
from scenarios.sip.mesh_focus import focused_on_path

REACH_MM = 0.5


def resting(neck: NeckSection, place: np.ndarray) -> RigidMotion:
    """Return the motion of a neck whose lower rim stays in front of a place."""
    left, low, _, high = neck.lower_wall.box
    shift = np.broadcast_to(place - (left, 0.5 * (low + high)), (2, 2))
    return RigidMotion(np.array([0.0, 1.0]), np.zeros(2), shift)


def test_only_skin_that_the_neck_comes_near_stays_in_the_focus() -> None:
    head, neck = head_section(), neck_section(NECKS["A38"])
    skin = head.lower.curves["skin"]
    place = skin[np.argmax(skin[:, 0])]
    motion = resting(neck, place)
    focused = focused_on_path(head, neck, motion, REACH_MM)
    walls = (neck.upper_wall, neck.lower_wall)
    local = motion.at(0.5).pull_back(focused.lower.focus)
    distance = np.min([wall.project(local).distance for wall in walls], axis=0)
    assert distance.max() < REACH_MM
    assert np.min(np.linalg.norm(focused.lower.focus - place, axis=1)) < REACH_MM
    whole, narrow = (section_mesh([h.lower], QUICK.mesh) for h in (head, focused))
    assert narrow.t.shape[1] < 0.8 * whole.t.shape[1]


def test_a_lip_that_the_neck_never_reaches_keeps_its_focus() -> None:
    head, neck = head_section(), neck_section(NECKS["A38"])
    far = focused_on_path(head, neck, resting(neck, np.array([1e3, 0.0])), REACH_MM)
    assert far.upper.focus == pytest.approx(head.upper.focus)
    assert far.lower.focus == pytest.approx(head.lower.focus)
