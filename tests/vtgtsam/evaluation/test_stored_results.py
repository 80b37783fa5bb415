# SPDX-License-Identifier: MIT
"""Damage to stored results is noticed and named, and made good where that can be done."""

import re
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from held_box import write_grasp

from vtgtsam import VtgtsamError, evaluate
from vtgtsam.evaluation.parquet import DamagedError
from vtgtsam.evaluation.report import make_report
from vtgtsam.evaluation.store import read_part
from vtgtsam.evaluation.tables import make_tables

METHODS = ["vis", "vis+pen"]


@pytest.fixture(scope="module")
def grasps(tmp_path_factory) -> Path:
    grasps = tmp_path_factory.mktemp("grasps")
    for seed in range(2):
        write_grasp(grasps / f"{seed}.mcap", seed=seed, frames=8)
    return grasps


@pytest.fixture(scope="module")
def whole(grasps, tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("whole")
    evaluate(grasps, METHODS, "tuned", out)
    return out


@pytest.fixture
def out(whole, tmp_path) -> Path:
    return shutil.copytree(whole, tmp_path / "out")


def content(out: Path) -> dict[str, bytes]:
    paths = (path for path in out.rglob("*") if path.is_file())
    return {path.relative_to(out).as_posix(): path.read_bytes() for path in paths}


def flip(path: Path, at: int) -> None:
    damaged = bytearray(path.read_bytes())
    damaged[at] ^= 0x10
    path.write_bytes(damaged)


@pytest.mark.parametrize("kind", ["estimates", "metrics"])
@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_a_flipped_byte_in_a_part_is_named_and_its_sequence_computed_again(
    grasps, out, caplog, kind, share
):
    before, part = content(out), out / kind / "1.parquet"
    flip(part, int(share * part.stat().st_size))
    evaluate(grasps, METHODS, "tuned", out)
    assert f"{part} is damaged" in caplog.text
    assert content(out) == before


def test_whatever_byte_is_flipped_the_error_names_the_file(out):
    path = out / "estimates" / "0.parquet"
    whole = path.read_bytes()
    rng = np.random.default_rng(0)
    for at in rng.permutation(len(whole))[:200]:
        damaged = bytearray(whole)
        damaged[at] ^= 1 << rng.integers(8)
        path.write_bytes(damaged)
        with pytest.raises(DamagedError, match=re.escape(str(path))):
            read_part(path)


def test_without_a_seal_a_damaged_table_is_read_or_named_but_never_a_traceback(out):
    path = out / "metrics" / "0.parquet"
    whole = path.read_bytes()
    (out / ".vtgtsam" / "parts" / "0.json").unlink()
    rng = np.random.default_rng(0)
    named = 0
    for at in rng.permutation(len(whole))[:400]:
        damaged = bytearray(whole)
        damaged[at] ^= 1 << rng.integers(8)
        path.write_bytes(damaged)
        try:
            read_part(path)
        except DamagedError:
            named += 1
    assert named > 100


def test_a_damaged_seal_costs_its_sequence_anew(grasps, out, caplog):
    before = content(out)
    (out / ".vtgtsam" / "parts" / "0.json").write_bytes(b"{")
    evaluate(grasps, METHODS, "tuned", out)
    assert "parts/0.json is damaged" in caplog.text
    assert content(out) == before


@pytest.mark.parametrize("name", ["metrics.parquet", "sequences.csv", "config.yaml"])
def test_a_report_refuses_what_is_not_what_was_stored_and_says_which_file(out, name):
    before = content(out)
    (out / name).write_bytes(before[name][: len(before[name]) // 2])
    with pytest.raises(VtgtsamError, match=rf"{name} is not what vtgtsam wrote"):
        make_tables(out)
    assert {n: b for n, b in content(out).items() if n != name} == {
        n: b for n, b in before.items() if n != name
    }


def test_what_a_report_refused_is_made_again_by_evaluate(grasps, out):
    before = content(out)
    for name in ("metrics.parquet", "sequences.csv", "config.yaml"):
        flip(out / name, 100)
    evaluate(grasps, METHODS, "tuned", out)
    assert content(out) == before


def test_a_report_names_damaged_estimates(out):
    pytest.importorskip("matplotlib")
    tables = make_tables(out)
    part = out / "estimates" / "0.parquet"
    part.write_bytes(part.read_bytes()[:1000])
    with pytest.raises(VtgtsamError, match=r"estimates/0\.parquet is damaged"):
        make_report(out, tables)


def test_older_results_without_digests_are_read_as_they_are(out):
    (out / ".vtgtsam" / "files.json").unlink()
    assert len(make_tables(out).summary)
    damaged = (out / "metrics.parquet").read_bytes()[:-100]
    (out / "metrics.parquet").write_bytes(damaged)
    with pytest.raises(VtgtsamError, match=r"metrics\.parquet is damaged"):
        make_tables(out)


def test_a_part_that_another_call_replaced_meanwhile_is_not_taken_for_ones_own(
    grasps, tmp_path, monkeypatch
):
    import vtgtsam.evaluation.run as run

    other = tmp_path / "other"
    evaluate(grasps, ["vis"], "tuned", other)
    collect = run._collect

    def late(out, *arguments):
        for kind in ("estimates", "metrics", ".vtgtsam/parts"):
            shutil.copytree(other / kind, out / kind, dirs_exist_ok=True)
        return collect(out, *arguments)

    monkeypatch.setattr(run, "_collect", late)
    with pytest.raises(VtgtsamError, match=r"metrics/0\.parquet was changed while this ran"):
        evaluate(grasps, METHODS, "tuned", tmp_path / "out")
    monkeypatch.undo()
    evaluate(grasps, METHODS, "tuned", tmp_path / "out")
    assert set(pd.read_parquet(tmp_path / "out" / "metrics.parquet")["method"]) == set(METHODS)
