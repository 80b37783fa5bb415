# SPDX-License-Identifier: MIT
import pytest

from sim.hands import load_description
from vtgtsam.exceptions import HandError


@pytest.mark.parametrize("name", ["isyhand", "fourfinger"])
def test_hands_are_found_by_name_wherever_they_lie(name):
    description = load_description(name)
    description.check(description.load_hand())


def test_an_unknown_hand_lists_the_known_ones():
    with pytest.raises(HandError, match="'shadow': known are fourfinger, isyhand"):
        load_description("shadow")
