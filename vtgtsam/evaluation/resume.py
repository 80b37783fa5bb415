# SPDX-License-Identifier: MIT
"""What a stored result was made from, so that only what is missing or changed is computed again."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path

from .. import __version__
from ..config import EstimatorConfig
from .remote import RemoteRecording


def sequence_key(
    recording: Path | RemoteRecording,
    configs: Mapping[str, EstimatorConfig],
    given: str,
    code: str,
) -> str:
    """Hash of all that one sequence's results depend on.

    Args:
        recording: The recording, whose content counts, not its name; of a remote one what its store
            says of the content, so that it need not be fetched.
        configs: Each method's configuration.
        given: Digest of what was given beside the recording (``Given.digest``).
        code: Version of the code (``code_version``).
    """
    made_from = {
        "recording": _content(recording),
        "methods": {name: config.model_dump(mode="json") for name, config in configs.items()},
        "given": given,
        "code": code,
    }
    return hashlib.sha256(json.dumps(made_from).encode()).hexdigest()


@cache
def code_version() -> str:
    """The package's version and a hash of its sources: a changed estimator is another estimator."""
    root = Path(__file__).parents[1]
    sources = sorted(path for path in root.rglob("*") if path.suffix in (".py", ".xml"))
    digest = hashlib.sha256()
    for path in sources:
        digest.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    return f"{__version__}+{digest.hexdigest()[:12]}"


def _content(path: Path | RemoteRecording) -> str:
    """Hash of a file, or of all files in a folder; a remote recording's version."""
    if isinstance(path, RemoteRecording):
        return path.version()
    digest = hashlib.sha256()
    for file in [path] if path.is_file() else sorted(p for p in path.rglob("*") if p.is_file()):
        with file.open("rb") as stream:
            digest.update(hashlib.file_digest(stream, "sha256").digest())
    return digest.hexdigest()
