# Each target is enough on a fresh machine with Python, make and a package index.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed

.PHONY: demo test test-slow test-browser test-gpu benchmark benchmark-digitise benchmark-simulate benchmark-validate benchmark-gpu reproduce picture lint clean

demo: $(STAMP)
	$(BIN)/sealtwin run fixtures/paper-trial/trial.toml --device cpu

test: $(STAMP)
	$(BIN)/pytest --numprocesses 2 --dist worksteal

test-slow: $(STAMP)
	$(BIN)/pytest -m slow

test-browser: $(STAMP)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[browser]' --constraint constraints.txt
	command -v chromium || { apt-get update && apt-get install --yes --no-install-recommends chromium; }
	$(BIN)/pytest -m browser

test-gpu: $(STAMP)
	$(BIN)/pytest -m gpu

benchmark: $(STAMP)
	$(BIN)/python benchmarks/paper_trial.py

benchmark-digitise: $(STAMP)
	$(BIN)/python benchmarks/tracing.py
	$(BIN)/python benchmarks/solids.py
	$(BIN)/python benchmarks/digitise_speed.py

benchmark-simulate: $(STAMP)
	$(BIN)/python benchmarks/pbf_step.py
	$(BIN)/python benchmarks/paper_run.py
	$(BIN)/python benchmarks/physics.py
	$(BIN)/python -m benchmarks.pressure

benchmark-validate: $(STAMP)
	$(BIN)/python benchmarks/ingest.py
	$(BIN)/python benchmarks/report_speed.py
	$(BIN)/python -m benchmarks.stated_intervals

benchmark-gpu: $(STAMP)
	$(BIN)/python -m benchmarks.cuda_runs

reproduce: $(STAMP)
	$(BIN)/python reports/reproduction/reproduce.py

picture: demo
	$(BIN)/python reports/images/draw.py reports/paper-trial

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/basedpyright
	$(BIN)/lint-imports

$(STAMP): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]' --constraint constraints.txt
	touch $@

clean:
	rm -rf $(VENV) .pytest_cache .ruff_cache .hypothesis
