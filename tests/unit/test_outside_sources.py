"""The order in which light from outside is given, and taken back where it has changed."""

from __future__ import annotations

import numpy as np

from app.scene.lights import Light
from app.solvers.shooting.outside_sources import Sources, difference, in_turns, share_of_shot, shots_of

BOX = np.ones(3)


def lamp_at(x: float) -> Sources:
    return {Light("", "point", intensity=(1.0, 1.0, 1.0), position=(x, 0.0, 0.0)): np.ones(3)}


def test_a_lamp_that_is_dragged_is_there_about_once() -> None:
    given = lamp_at(0.0)
    for x in range(1, 9):
        queue = in_turns(shots_of(difference(lamp_at(float(x)), given), BOX))
        for shot in queue[:2]:  # both halves of one lamp, until it moves on
            given[shot.source] = given.get(shot.source, np.zeros(3)) + shot.light * share_of_shot(shot.source)
        assert 1 <= sum(light[0] for light in given.values()) <= 2
        given = {source: light for source, light in given.items() if light.any()}
