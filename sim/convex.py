# SPDX-License-Identifier: MIT
"""Convex parts of an object, which is what MuJoCo computes contacts with.

Where the convex hull is hardly larger than the object, the hull is the only part; else CoACD (Wei et
al., SIGGRAPH 2022) cuts the mesh, which takes up to a minute, once: the parts are kept in the cache.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vtgtsam.cache import cached_arrays
from vtgtsam.exceptions import VtgtsamError
from vtgtsam.meshes import sha256_of

if TYPE_CHECKING:
    import trimesh

HULL_RATIO = 1.1  # hull volume / mesh volume below which the hull is good enough
CONCAVITY = 0.03  # CoACD's threshold, relative to the object's size
_VERSION = "1"  # raise when the same mesh is to give other parts

Part = tuple[np.ndarray, np.ndarray]


def convex_parts(mesh: trimesh.Trimesh) -> list[Part]:
    """Convex parts whose union is about the object: vertices (V, 3) [m] and faces (F, 3) of each.

    Raises:
        VtgtsamError: The object needs cutting and CoACD is not installed.
    """
    key = f"{sha256_of(mesh.vertices, mesh.faces)[:32]}-{CONCAVITY}-{_VERSION}"
    arrays = cached_arrays("convex", key, lambda: _pack(_compute(mesh)))
    return _unpack(arrays)


def _compute(mesh: trimesh.Trimesh) -> list[Part]:
    hull = mesh.convex_hull
    if hull.volume < HULL_RATIO * abs(mesh.volume):
        return [(np.asarray(hull.vertices), np.asarray(hull.faces))]
    try:
        import coacd
    except ImportError as error:
        raise VtgtsamError(
            "this object is not convex and cutting it needs CoACD: pip install coacd"
        ) from error
    coacd.set_log_level("error")
    parts = coacd.run_coacd(coacd.Mesh(mesh.vertices, mesh.faces), threshold=CONCAVITY, seed=0)
    return [(np.asarray(vertices), np.asarray(faces)) for vertices, faces in parts]


def _pack(parts: list[Part]) -> dict[str, np.ndarray]:
    return {
        "vertices": np.concatenate([vertices for vertices, _ in parts]),
        "faces": np.concatenate([faces for _, faces in parts]),
        "counts": np.array([(len(vertices), len(faces)) for vertices, faces in parts]),
    }


def _unpack(arrays: dict[str, np.ndarray]) -> list[Part]:
    cuts = np.cumsum(arrays["counts"], axis=0)[:-1]
    vertices = np.split(arrays["vertices"], cuts[:, 0])
    return list(zip(vertices, np.split(arrays["faces"], cuts[:, 1]), strict=True))
