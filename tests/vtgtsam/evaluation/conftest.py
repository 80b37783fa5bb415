# SPDX-License-Identifier: MIT
import pytest


@pytest.fixture(scope="session")
def reported(tmp_path_factory):
    """A folder with tables, figures and the page of one dataset at two noise scales."""
    from made_results import write_results

    from vtgtsam.evaluation.report import make_report
    from vtgtsam.evaluation.tables import make_tables

    out = tmp_path_factory.mktemp("reported")
    write_results(out, scales=("1", "2"), objects=list("abcdef"), failed=["broken"])
    make_report(out, make_tables(out))
    return out
