# Two commands do everything on a fresh machine: make run, make test.
PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin
PYTEST := $(BIN)/python -m pytest -n 2 --dist worksteal
GLSL   := tests/gpu/test_shaders.py tests/gpu/test_shader_library.py
SOLVE  := tests/physics/test_energy.py::test_light_is_conserved_around_a_table
BAKE   := tests/gpu/test_baking.py::test_the_scene_as_edited_is_written_with_its_light

.PHONY: run test setup lint

run: $(VENV)/.run
	$(BIN)/glowtree view

# What OpenGL 4.1 lacks is found in such a context, and what newer drivers refuse by the whole application in their own; also
# where there is no screen, by a solve and a bake
test: $(VENV)/.dev lint
	$(PYTEST) tests/unit tests/gpu tests/physics --gl41
	$(PYTEST) tests/desktop tests/screenshots tests/web $(GLSL) $(SOLVE) $(BAKE)

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

$(VENV)/.run: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet -e .
	touch $@

$(VENV)/.dev: $(VENV)/.run
	$(BIN)/python -m pip install --quiet -e ".[dev]"
	touch $@
