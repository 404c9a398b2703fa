# Each target is enough on a fresh machine with Python, make and a package index.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed
DEVELOPING := $(VENV)/.installed-dev

.PHONY: demo test coverage test-slow test-browser test-gpu benchmark benchmark-digitise benchmark-simulate benchmark-validate benchmark-peers benchmark-gpu results reproduce picture docs docs-gallery lint clean

demo: $(INSTALLED)
	$(BIN)/sealtwin run fixtures/paper-trial/trial.toml --device cpu

test: $(DEVELOPING)
	$(BIN)/pytest --numprocesses 2 --dist worksteal

# Branch coverage of each package by 'make test'.
coverage: $(DEVELOPING)
	$(BIN)/pytest --numprocesses 2 --dist worksteal --cov-branch --cov=digitise --cov=simulate --cov=validate --cov=sealtwin

test-slow: $(DEVELOPING)
	$(BIN)/pytest -m slow

test-browser: $(DEVELOPING)
	$(BIN)/python -m pip install -qq --disable-pip-version-check --editable '.[browser]' --constraint constraints.txt
	command -v chromium || { apt-get update && apt-get install --yes --no-install-recommends chromium; }
	$(BIN)/pytest -m browser

test-gpu: $(DEVELOPING)
	$(BIN)/pytest -m gpu

benchmark: $(DEVELOPING)
	$(BIN)/python -m benchmarks.paper_trial

benchmark-digitise: $(DEVELOPING)
	$(BIN)/python -m benchmarks.tracing
	$(BIN)/python -m benchmarks.solids
	$(BIN)/python -m benchmarks.line_verdict

benchmark-simulate: $(DEVELOPING)
	$(BIN)/python -m benchmarks.pbf_step
	$(BIN)/python -m benchmarks.speed_bars
	$(BIN)/python -m benchmarks.physics

benchmark-validate: $(DEVELOPING)
	$(BIN)/python -m benchmarks.ingest
	$(BIN)/python -m benchmarks.sound_trials
	$(BIN)/python -m benchmarks.first_fills
	$(BIN)/python -m benchmarks.fuzz
	$(BIN)/python -m benchmarks.scans
	$(BIN)/python -m benchmarks.stated_intervals

benchmark-peers: $(DEVELOPING)
	$(BIN)/python -m pip install -qq --disable-pip-version-check --editable '.[peers]' --constraint constraints.txt
	$(BIN)/python -m benchmarks.peers

benchmark-gpu: $(DEVELOPING)
	$(BIN)/python -m benchmarks.cuda_runs

# Every benchmark; what ran on this very code is not run again.
results: $(DEVELOPING)
	$(BIN)/python -m benchmarks.results

reproduce: $(INSTALLED)
	$(BIN)/python -m reports.reproduction.reproduce

# README's picture and its sample report.
picture: $(DEVELOPING) demo
	$(BIN)/sealtwin validate reports/paper-trial --set output.pictures=true --quiet
	$(BIN)/python reports/images/draw.py reports/paper-trial

# GALLERY=1 also runs the examples and shows their figures. The demo's report lies beside the pages.
docs: $(DEVELOPING) demo
	$(BIN)/python -m sphinx --builder html --fail-on-warning --keep-going --quiet docs docs/_build/html
	mkdir -p docs/_build/html/paper-trial
	$(BIN)/sealtwin validate reports/paper-trial --set output.pictures=true --quiet
	cp reports/paper-trial/report.html reports/paper-trial/report.pdf docs/_build/html/paper-trial
	@echo "Documentation: docs/_build/html/index.html"

docs-gallery:
	$(MAKE) docs GALLERY=1

lint: $(DEVELOPING)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/basedpyright
	$(BIN)/lint-imports
	$(BIN)/python -m tests.house_rules
	$(BIN)/python -m tests.house_sizes

# What running needs, and no development tool.
$(INSTALLED): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install -qq --disable-pip-version-check --editable . --constraint constraints.txt
	touch $@

# What tests, lints, benchmarks and the documentation need beside it.
$(DEVELOPING): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install -qq --disable-pip-version-check --no-compile --editable '.[dev]' --constraint constraints.txt
	touch $(INSTALLED) $@

clean:
	rm -rf $(VENV) docs/_build docs/gallery .pytest_cache .ruff_cache .hypothesis
