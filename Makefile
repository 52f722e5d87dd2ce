# What one does with Regraft. Everything is installed into .venv first, from the pinned versions in requirements.lock.
PYTHON ?= python3
BIN := .venv/bin

.PHONY: help frog test check bench evidence lock clean

help: ## Say what there is
	@grep -hE '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:[^#]*## /\t/' | expand -t 12

frog: .venv/ready ## Run FROG: a dozen processes in a simulated room
	$(BIN)/regraft up stacks/frog

test: .venv/ready ## Pass the tests (a few minutes)
	$(BIN)/pytest

check: .venv/ready ## Format, lint, types, architecture
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: .venv/ready ## Measure every budget as a ratio
	$(BIN)/python -m benchmarks

evidence: .venv/ready ## What is too slow for the tests: seeds, load, endurance
	$(BIN)/pytest -n 0 -m evidence --timeout 3600

lock: .venv/ready ## Write the versions in use to requirements.lock
	$(BIN)/pip freeze --exclude-editable > requirements.lock

clean: ## Remove what was installed and cached
	rm -rf .venv build *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache

.venv/ready: pyproject.toml requirements.lock
	@echo "installing into .venv: about half a minute"
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check -c requirements.lock -e '.[dev]'
	touch $@
