# The commands of this repository. `make demo` and `make test` need nothing set up beforehand.
PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin
WORKERS ?= 2
ROS    ?= .venv-ros
LEROBOT ?= .venv-lerobot
PYTHON12 ?= python3.12

.PHONY: demo test test-ros test-lerobot slow fuzz check setup docs wheel theseus clean

setup: $(VENV)/.installed

$(VENV)/.installed: pyproject.toml tools/setup.sh
	PYTHON="$(PYTHON)" VENV="$(VENV)" sh tools/setup.sh
	@touch $@

demo: setup
	PATH="$(abspath $(BIN)):$$PATH" sh tools/demo.sh

test: setup
	@sh tools/browser.sh
	$(BIN)/python -m pytest -n $(WORKERS) --dist worksteal

# The ROS 2 node with the genuine rclpy, in an environment of its own; `make test` skips these tests.
test-ros: $(ROS)/.installed
	$(ROS)/bin/python -m pytest tests/vtgtsam/ros tests/hardware/test_ros_hand.py

$(ROS)/.installed: pyproject.toml tools/ros.sh
	PYTHON="$(PYTHON)" ROS="$(ROS)" sh tools/ros.sh
	@touch $@

# The dataset that `vtgtsam export-lerobot` writes, read back by the genuine LeRobot; needs a Python 3.12.
test-lerobot: $(LEROBOT)/.installed
	$(LEROBOT)/bin/python -m pytest tests/vtgtsam/evaluation/test_genuine_lerobot.py

$(LEROBOT)/.installed: pyproject.toml tools/lerobot.sh
	PYTHON="$(PYTHON12)" LEROBOT="$(LEROBOT)" sh tools/lerobot.sh
	@touch $@

slow: setup
	$(BIN)/python -m pytest -n $(WORKERS) --dist worksteal -m slow

# Mutated files of every kind for SECONDS each; SEED=7 make fuzz tries others.
SEED ?= 0
SECONDS ?= 60
fuzz: setup
	PYTHONPATH=tests:. $(BIN)/python -m fuzzing --seed $(SEED) --seconds $(SECONDS)

check: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

docs: setup
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict
	@echo "open site/index.html in a browser"

# sdist and wheel into dist/, tried in bare environments: make wheel PYTHONS="python3.11 python3.12 python3.13"
PYTHONS ?= $(PYTHON)
wheel:
	PYTHONS="$(PYTHONS)" sh tools/wheel.sh

theseus:
	PYTHON="$(PYTHON)" sh tools/theseus.sh

clean:
	rm -rf $(VENV) $(ROS) $(LEROBOT) demo-output site dist .pytest_cache .mypy_cache .ruff_cache
