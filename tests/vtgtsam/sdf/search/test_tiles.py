# SPDX-License-Identifier: MIT
import numpy as np
import pytest

from vtgtsam import Pad, PadSet
from vtgtsam.sdf.search.tiles import TILE, cut_into_tiles

SMALL, LARGE = (0.014, 0.018), (0.03, 0.035)
MARGIN = 1e-6


@pytest.fixture
def pads():
    odd = Pad("odd", (0.02, 0.02), np.random.default_rng(0).normal(0, 0.01, (3, 3)))
    return PadSet([Pad("a", SMALL), Pad("b", LARGE), odd, Pad("c", SMALL), Pad("d", LARGE)])


def test_every_point_is_in_a_tile_and_every_tile_is_full(pads):
    tiles = cut_into_tiles(pads, MARGIN)
    for k, pad in enumerate(pads.pads):
        first = tiles.first[k] * TILE
        places = slice(first, first + tiles.counts[k] * TILE)
        assert set(tiles.order[places]) == set(range(len(pad.points_p)))
        np.testing.assert_array_equal(tiles.points[places], pad.points_p[tiles.order[places]])
    np.testing.assert_array_equal(tiles.coordinates, tiles.points.T.astype(np.float32))
    np.testing.assert_array_equal(tiles.offsets, pads.offsets[:-1])


def test_pads_with_the_same_points_share_their_tiles(pads):
    first = cut_into_tiles(pads, MARGIN).first
    assert first[0] == first[3] != first[1] == first[4]
    alone = cut_into_tiles(PadSet(pads.pads[:3]), MARGIN)
    assert len(cut_into_tiles(pads, MARGIN).points) == len(alone.points)


def test_a_tile_is_in_its_box_and_compact(pads):
    tiles = cut_into_tiles(pads, MARGIN)
    points = tiles.coordinates.astype(float).reshape(3, -1, TILE)
    beyond = np.abs(points - tiles.boxes[:3, :, None]) - tiles.boxes[3:, :, None]
    assert (beyond <= -0.5 * MARGIN).all()
    assert tiles.radius == np.linalg.norm(tiles.boxes[3:], axis=0).max()
    of_grids = slice(tiles.first[0], tiles.first[0] + tiles.counts[0])
    assert np.linalg.norm(tiles.boxes[3:, of_grids], axis=0).max() < 0.0025  # [m]


def test_a_pads_box_holds_its_points(pads):
    boxes = cut_into_tiles(pads, MARGIN).pad_boxes
    for pad, (centre, half) in zip(pads.pads, boxes, strict=True):
        np.testing.assert_allclose(np.abs(pad.points_p - centre).max(axis=0), half, atol=1e-15)
