# SPDX-License-Identifier: MIT
"""Every kind of input, by name."""

from .bag import BAG
from .bench import BENCH
from .cache import CACHE
from .contents import CONTENTS
from .hand import HAND
from .kind import Kind
from .mesh import MESH
from .poses import POSES
from .recording import RECORDING
from .results import RESULTS
from .yaml import YAML

KINDS: dict[str, Kind] = {
    "recording": RECORDING,
    "bag": BAG,
    "contents": CONTENTS,
    "hand": HAND,
    "mesh": MESH,
    "yaml": YAML,
    "poses": POSES,
    "results": RESULTS,
    "cache": CACHE,
    "bench": BENCH,
}
