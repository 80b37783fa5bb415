# SPDX-License-Identifier: MIT
import pytest
from pydantic import ValidationError

from vtgtsam import EstimatorConfig, VtgtsamError


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
        ("iterations: many", "iterations must be a whole number, got 'many'$"),
        ("w_vis: -1", "yaml: w_vis must be above 0, got -1$"),
        ("w_vis: [1, -2]", "yaml: w_vis.translation must be above 0, got -2$"),
        ("w_vis: {rotation: 0, translation: 1}", "yaml: w_vis.rotation must be above 0, got 0$"),
        ("w_vis: [1, 2, 3]", "w_vis must be one number, or two: rotation and translation, got"),
        ("w_pen: .inf", "w_pen must be finite, got inf$"),
        ("method: tac", "method must be 'vis', 'vis.pen' or 'vis.tac.pen', got 'tac'$"),
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


def test_an_empty_file_means_the_defaults(tmp_path):
    (tmp_path / "config.yaml").write_text("# nothing\n")
    assert EstimatorConfig.from_yaml(tmp_path / "config.yaml") == EstimatorConfig()


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(VtgtsamError, match="absent.yaml"):
        EstimatorConfig.from_yaml(tmp_path / "absent.yaml")
