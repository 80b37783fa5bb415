# SPDX-License-Identifier: MIT
"""Distances at grid nodes: a block of 4 x 4 x 4 is one packet."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from .boxes import STACK
from .packets import nearest_to_packet
from .tree import Tree
from .triangles import Packet

BLOCK = 4  # nodes along a side of a block


@compiled
def fill_blocks(
    tree: Tree,
    ticks: NDArray[np.float64],
    start: int,
    out: NDArray[np.float64],
    packet: Packet,
    gaps: NDArray[np.float64],
) -> None:
    """Distances at one layer of blocks, at the nodes x = ``ticks[start + i]``, y and z = ``ticks``.

    Writes ``out`` (up to BLOCK, n, n); ``packet`` of BLOCK^3 points and ``gaps`` (8,) are scratch.
    """
    stack, bounds = np.empty(STACK, np.int64), np.empty(STACK)
    layers, nodes, slot = len(out), len(ticks), 0
    for j in range(0, nodes, BLOCK):
        for k in range(0, nodes, BLOCK):
            rows, columns = min(BLOCK, nodes - j), min(BLOCK, nodes - k)
            count = layers * rows * columns
            for n in range(count):
                packet.x[n] = ticks[start + n // (rows * columns)]
                packet.y[n] = ticks[j + n // columns % rows]
                packet.z[n] = ticks[k + n % columns]
            slot = nearest_to_packet(tree, packet, count, slot, stack, bounds, gaps)
            for n in range(count):
                place = n // (rows * columns), j + n // columns % rows, k + n % columns
                out[place] = np.sqrt(packet.squared[n])
