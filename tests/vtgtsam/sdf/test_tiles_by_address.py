# SPDX-License-Identifier: MIT
import numpy as np
import pytest

from vtgtsam import Pad, PadSet
from vtgtsam.sdf.tiles import (
    FIRST_FLOOR,
    FIRST_INDEX,
    FIRST_POINT,
    FIRST_TILE,
    TILE,
    TILES,
    cut_into_tiles,
)

SMALL, LARGE = (0.014, 0.018), (0.03, 0.035)
MARGIN = 1e-6


@pytest.fixture
def pads():
    odd = Pad("odd", (0.02, 0.02), np.random.default_rng(0).normal(0, 0.01, (3, 3)))
    return PadSet([Pad("a", SMALL), Pad("b", LARGE), odd, Pad("c", SMALL), Pad("d", LARGE)])


def test_every_point_is_in_a_tile_and_every_tile_is_full(pads):
    tiles = cut_into_tiles(pads, MARGIN)
    for pad, row in zip(pads.pads, tiles.pads, strict=True):
        members = tiles.order[row[FIRST_TILE] * TILE : (row[FIRST_TILE] + row[TILES]) * TILE]
        assert set(members) == set(range(len(pad.points_p)))
        points = tiles.points[row[FIRST_POINT] : row[FIRST_POINT] + len(pad.points_p)]
        np.testing.assert_array_equal(points, pad.points_p)


def test_pads_with_the_same_points_share_their_tiles_but_not_their_floors(pads):
    tiles = cut_into_tiles(pads, MARGIN)
    first = tiles.pads[:, FIRST_TILE]
    assert first[0] == first[3] != first[1] == first[4]
    assert len(tiles.points) == sum(len(pads.pads[k].points_p) for k in (0, 1, 2))
    np.testing.assert_array_equal(np.diff(tiles.pads[:, FIRST_FLOOR]), tiles.pads[:-1, TILES])
    np.testing.assert_array_equal(tiles.pads[:, FIRST_INDEX], pads.offsets[:-1])


def test_a_tile_is_in_its_box_and_compact(pads):
    tiles = cut_into_tiles(pads, MARGIN)
    points = tiles.coordinates.astype(float).reshape(3, -1, TILE)
    beyond = np.abs(points - tiles.boxes[:3, :, None]) - tiles.boxes[3:, :, None]
    assert (beyond <= -0.5 * MARGIN).all()
    of_grids = tiles.pads[0, FIRST_TILE], tiles.pads[0, TILES]
    radius = np.linalg.norm(tiles.boxes[3:, of_grids[0] : sum(of_grids)], axis=0)
    assert radius.max() < 0.0025  # [m]
