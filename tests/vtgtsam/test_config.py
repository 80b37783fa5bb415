# SPDX-License-Identifier: MIT
import typing

import pytest
from pydantic import ValidationError

from vtgtsam import EstimatorConfig, VtgtsamError
from vtgtsam.config import PRESETS, Settings


def test_a_plain_config_is_the_recommended_one_with_what_is_given_changed():
    assert EstimatorConfig() == EstimatorConfig.tuned()
    changed = EstimatorConfig(iterations=3, recover=False)
    assert changed == EstimatorConfig.tuned(iterations=3, recover=False)
    assert changed.differences() == {"iterations": 3, "recover": False}
    assert EstimatorConfig().differences() == {}


def test_the_papers_settings_differ_from_the_recommended_ones():
    assert set(EstimatorConfig.simulation().differences()) >= {"w_vis", "w_tac", "log_theta_vis"}


def test_what_a_preset_can_override_is_every_setting():
    assert set(typing.get_type_hints(Settings)) == set(EstimatorConfig.model_fields)


def test_the_presets_are_the_papers_table():
    simulation, real = EstimatorConfig.simulation(), EstimatorConfig.real_world()
    assert (simulation.iterations, simulation.damping) == (5, 0.02)
    assert (simulation.log_theta_vis, simulation.log_theta_tac) == (-6.5, 0.0)
    assert (real.iterations, real.damping) == (2, 0.02)
    assert (real.log_theta_vis, real.log_theta_tac) == (-5.0, -7.5)
    for preset in (simulation, real):
        assert (preset.w_vis, preset.w_tac, preset.w_pen, preset.recover) == (1.0, 1.0, 1.0, False)


@pytest.mark.parametrize(
    "config",
    [
        EstimatorConfig.simulation(),
        EstimatorConfig.real_world(solver="fixed-damping"),
        EstimatorConfig.tuned(w_vis={"rotation": 2, "translation": 3}),
    ],
)
def test_a_file_holds_all_settings(config, tmp_path):
    config.to_yaml(tmp_path / "config.yaml")
    assert EstimatorConfig.from_yaml(tmp_path / "config.yaml") == config


def test_overrides_win_over_the_preset():
    assert EstimatorConfig.real_world(iterations=7).iterations == 7
    assert EstimatorConfig.tuned(recover=False).recover is False


def test_one_visual_weight_counts_for_both():
    assert EstimatorConfig(w_vis=4.0).visual_weights == (4.0, 4.0)
    assert EstimatorConfig(w_vis=(1.0, 2.0)).visual_weights.translation == 2.0


@pytest.mark.parametrize(
    "wrong",
    [
        {"weights": 1.0},
        {"iterations": 0},
        {"iterations": 2.5},
        {"damping": 0.0},
        {"engine": "compiled"},
        {"log_theta_vis": 800},
        {"log_theta_tac": -800},
        {"w_vis": [1e308, 1e-308]},
        {"w_pen": 1e-200},
        {"w_tac": -1.0},
        {"w_vis": (1.0, 0.0)},
        {"w_pen": float("nan")},
        {"log_theta_vis": float("inf")},
        {"method": "tac"},
        {"solver": "gauss-newton"},
    ],
)
def test_a_wrong_setting_is_refused(wrong):
    with pytest.raises(ValidationError):
        EstimatorConfig(**wrong)


def test_a_config_cannot_be_changed():
    with pytest.raises(ValidationError, match="frozen"):
        EstimatorConfig().iterations = 3


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("iteration: 3", "unknown setting 'iteration' .known: method, solver, iterations"),
        ("engine: gtsam", "the setting 'engine' is gone, leave it out: every frame is a graph"),
        ("log_theta_vis: 800", "yaml: log_theta_vis must be at most 100.0, got 800$"),
        ("log_theta_tac: -800", "yaml: log_theta_tac must be at least -100.0, got -800$"),
        ("w_vis: [1e+308, 1e-308]", "yaml: w_vis.rotation must be at most 1e.18, got '1e.308'$"),
        ("w_tac: 1.0e+30", "yaml: w_tac must be at most 1e.18, got 1e.30$"),
        ("preset: paper", "preset must be one of simulation, real_world, tuned, got 'paper'$"),
        ("iterations: many", "iterations must be a whole number, got 'many'$"),
        ("w_vis: -1", "yaml: w_vis must be at least 1e-12, got -1$"),
        ("w_vis: [1, -2]", "yaml: w_vis.translation must be at least 1e-12, got -2$"),
        (
            "w_vis: {rotation: 0, translation: 1}",
            "yaml: w_vis.rotation must be at least 1e-12, got 0$",
        ),
        ("w_vis: [1, 2, 3]", "w_vis must be one number, or two: rotation and translation, got"),
        ("w_pen: .inf", "w_pen must be finite, got inf$"),
        (
            "method: tac",
            "method must be 'vis', 'vis.pen', 'vis.tac.pen' or 'vis.tac.pen.mem', got 'tac'$",
        ),
        ("- 3", "expected a mapping of setting to value, got a list"),
        ("a: [", "settings from .* is not valid YAML"),
    ],
)
def test_a_wrong_file_is_explained_in_one_sentence(text, message, tmp_path):
    path = tmp_path / "config.yaml"
    path.write_text(text)
    with pytest.raises(VtgtsamError, match=message) as error:
        EstimatorConfig.from_yaml(path)
    assert "\n" not in str(error.value).strip() or "a: [" in text


def read(text, tmp_path):
    (tmp_path / "config.yaml").write_text(text)
    return EstimatorConfig.from_yaml(tmp_path / "config.yaml")


def test_a_file_means_the_recommended_settings_with_what_it_says_changed(tmp_path):
    assert read("iterations: 3", tmp_path) == EstimatorConfig.tuned(iterations=3)


@pytest.mark.parametrize("preset", list(PRESETS))
def test_a_file_may_begin_with_a_preset(preset, tmp_path):
    assert read(f"preset: {preset}", tmp_path) == PRESETS[preset]()
    assert read(f"preset: {preset}\nw_tac: 7", tmp_path) == PRESETS[preset](w_tac=7.0)


def test_a_file_without_preset_does_not_differ_from_one_that_names_the_recommended(tmp_path):
    assert read("w_tac: 7", tmp_path) == read("preset: tuned\nw_tac: 7", tmp_path)


def test_an_empty_file_means_the_defaults(tmp_path):
    (tmp_path / "config.yaml").write_text("# nothing\n")
    assert EstimatorConfig.from_yaml(tmp_path / "config.yaml") == EstimatorConfig()


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(VtgtsamError, match="absent.yaml"):
        EstimatorConfig.from_yaml(tmp_path / "absent.yaml")
    with pytest.raises(VtgtsamError, match="the path of a YAML file, got int"):
        EstimatorConfig.from_yaml(3)
