# SPDX-License-Identifier: MIT
import pytest

from vtgtsam.compiled.stale import drop_stale


@pytest.fixture
def package(tmp_path):
    (tmp_path / "sub" / "__pycache__").mkdir(parents=True)
    (tmp_path / "sub" / "caller.py").write_text("@compiled\ndef f(): ...\n")
    (tmp_path / "sub" / "numbers.py").write_text("SIZE = 8\n")
    (tmp_path / "more").mkdir()
    (tmp_path / "callee.py").write_text("@inlined\ndef g(): return 1\n")
    (tmp_path / "more" / "other.py").write_text("def h(): ...\n")
    drop_stale(tmp_path)
    return tmp_path


def machine_code(package):
    file = package / "sub" / "__pycache__" / "caller.f-1.py311.nbi"
    file.write_bytes(b"code")
    return file


def test_machine_code_stays_while_its_sources_do(package):
    file = machine_code(package)
    (package / "more" / "other.py").write_text("def h(): return 2\n")  # nothing compiled there
    drop_stale(package)
    assert file.exists()


def test_a_change_of_what_is_called_lets_go_of_the_callers_machine_code(package):
    file = machine_code(package)
    (package / "callee.py").write_text("@inlined\ndef g(): return 2\n")
    drop_stale(package)
    assert not file.exists()
    file = machine_code(package)
    drop_stale(package)
    assert file.exists()


def test_a_change_of_a_number_beside_compiled_functions_lets_go_of_it_too(package):
    file = machine_code(package)
    (package / "sub" / "numbers.py").write_text("SIZE = 4\n")
    drop_stale(package)
    assert not file.exists()


def test_a_folder_that_cannot_be_written_to_is_left_alone(package, monkeypatch):
    machine_code(package)
    (package / "callee.py").write_text("@inlined\ndef g(): return 3\n")

    def refuse(*args, **kwargs):
        raise PermissionError("read-only")

    monkeypatch.setattr("pathlib.Path.unlink", refuse)
    drop_stale(package)
