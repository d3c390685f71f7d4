# Everything here is thin over the package's own commands. Works in an activated virtual
# environment, or makes its own in .venv.
PYTHON ?= python3
VENV := $(if $(VIRTUAL_ENV),$(VIRTUAL_ENV),.venv)
BIN := $(VENV)/bin
DRIVER := $(BIN)/liggghts-driver
INSTALLED := $(VENV)/.liggghts-driver-installed
SUDO := $(if $(filter 0,$(shell id -u)),,sudo)

.PHONY: demo test lint validate bench paper docs engine cluster clean

demo: $(INSTALLED) engine           ## the main job on a small case, with a report
	# "Not steady" is an answer too, with a report; a run that failed has none.
	$(DRIVER) run cases/infiltration_small.toml --tolerance 0.05 || ls runs/infiltration_small-*/report.html

test: lint engine cluster           ## lint, types and every quick test
	$(BIN)/pytest -q -m "not validate"

lint: $(INSTALLED)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

validate: $(INSTALLED) engine cluster   ## the long checks
	$(BIN)/pytest -q -m validate

bench: $(INSTALLED) engine          ## measure, side by side; rewrites docs/benchmarks*.md
	$(BIN)/python -m tests.bench
	$(BIN)/python -m tests.bench.sweeps

paper: $(INSTALLED) engine          ## the paper's example in all its readings: hours, resumable
	$(DRIVER) study paper               # with docs/paper.md, its figures and docs/paper/results.json

docs: $(INSTALLED)                  ## what the documentation takes from the code
	$(DRIVER) schema > docs/scene.schema.json
	$(DRIVER) schema --markdown > docs/scene.md

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)

$(INSTALLED): pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --editable ".[dev]"
	touch $@

# LIGGGHTS itself, from Debian; nothing happens where it is there already.
engine:
	@command -v liggghts >/dev/null && command -v mpirun >/dev/null || \
	  { $(SUDO) apt-get update -qq && $(SUDO) env DEBIAN_FRONTEND=noninteractive \
	    apt-get install -y -qq --no-install-recommends liggghts openmpi-bin; }

# A real Slurm, for the tests of sweeps alone; they start it themselves, on loopback.
cluster:
	@command -v slurmctld >/dev/null && command -v munged >/dev/null || \
	  { $(SUDO) apt-get update -qq && $(SUDO) env DEBIAN_FRONTEND=noninteractive \
	    apt-get install -y -qq --no-install-recommends slurm-wlm munge; }

clean:
	rm -rf build dist .mypy_cache .pytest_cache .ruff_cache
