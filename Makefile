# All that one does with Regraft. The packages that it needs are installed into .venv first, as the files in requirements/ pin them.
PYTHON ?= python3
# A dozen processes start at once: let Python keep what it compiles, also where the environment says not to.
unexport PYTHONDONTWRITEBYTECODE
BIN := .venv/bin
INSTALL = $(BIN)/pip install --disable-pip-version-check
COMPILE = build/lock/bin/pip-compile --quiet --no-emit-index-url --no-emit-trusted-host --no-emit-find-links --generate-hashes --strip-extras --allow-unsafe --upgrade --no-header --no-annotate

OTHER := build/$(notdir $(PYTHON))
# What Python's version could break: the language, the standard library, compiled packages, processes, asyncio, installing.
PORTABLE := tests/behavior_tree tests/kit tests/schema tests/stack tests/gateway/test_server.py tests/outside/test_wheel.py
PORTABLE_RUN := tests/frog/test_runs.py::test_a_run_closes_with_one_object_and_equal_seeds_give_equal_digests
# What each change must pass.
ALWAYS := not evidence and not attack
# The benchmarks compare times; coverage.py complains at its end where there is no room for a file.
NOT_MEASURED := --ignore tests/benchmarks --deselect tests/evaluation/test_campaign.py::test_without_room_it_says_so_and_leaves_no_half_of_a_table

.PHONY: help frog patrol test test-slow test-python check coverage bench evidence attack docs lock clean

help: ## Say what there is
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:[^#]*## /\t/' | expand -t 12

frog: .venv/frog ## Run FROG: a dozen processes in a simulated room
	$(BIN)/regraft up frog

patrol: .venv/frog ## Run the patrol: a robot on corridors whose laser, camera and battery may fail
	$(BIN)/regraft up patrol

test: .venv/ready ## Pass the tests (a few minutes)
	$(BIN)/pytest

test-slow: .venv/ready ## Pass the slow tests: systems of processes, robots on missions, several hosts, attacked systems, studies, the installed package
	$(BIN)/pytest -m "slow and $(ALWAYS)"

test-python: $(OTHER)/ready ## Pass what another Python could break: make test-python PYTHON=python3.12
	$(OTHER)/bin/pytest -m "$(ALWAYS)" $(PORTABLE) $(PORTABLE_RUN)

check: .venv/ready ## Format, lint, types, architecture
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	@! test -f build/coverage/rooms.txt || tail -n 1 build/coverage/rooms.txt

coverage: .venv/ready ## Pass the quick and the slow tests and measure which code they reach: build/coverage
	rm -rf build/coverage
	mkdir -p build/coverage
	$(BIN)/coverage run -m pytest -m "$(ALWAYS)" $(NOT_MEASURED); code=$$?; \
	$(BIN)/coverage combine --quiet && $(BIN)/coverage html --quiet && $(BIN)/coverage json --quiet && \
	$(BIN)/python -m tests.coverage_by_room && exit $$code

bench: .venv/ready ## Measure every budget as a ratio
	$(BIN)/python -m benchmarks

evidence: .venv/ready ## What is too slow for the tests: seeds, load, endurance; continues where it stopped
	$(BIN)/python -m pytest -p tests.continued.plugin -n $(shell nproc) --dist worksteal -m "evidence and not alone" --timeout 3600; code=$$?; \
	$(BIN)/python -m pytest -p tests.continued.plugin -n 0 -m "evidence and alone" --timeout 3600 && exit $$code

attack: .venv/ready ## Attack everything anew, and say what held (six minutes)
	$(BIN)/pytest -n 2 -m attack tests/attack

docs: .venv/docs ## Build the documentation as a site, in build/docs
	$(BIN)/sphinx-build -q -W --keep-going docs build/docs
	@echo "build/docs/index.html"

lock: ## Choose the newest versions that fit, and write them to requirements/ with their hashes
	$(PYTHON) -m venv build/lock
	build/lock/bin/pip install --quiet --disable-pip-version-check pip-tools==7.6.2
	$(COMPILE) --extra robot --output-file requirements/robot.txt pyproject.toml
	$(COMPILE) --extra dev --constraint requirements/robot.txt --output-file requirements/dev.txt pyproject.toml
	$(COMPILE) --extra robot --extra docs --constraint requirements/dev.txt --output-file requirements/docs.txt pyproject.toml
	sed -i '/^regraft @/d;/^#/d;/^$$/d' requirements/*.txt

clean: ## Remove what was installed and cached
	rm -rf .venv build *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache

# FROG's packages are compiled as they are imported, which is a fraction of them.
.venv/frog: pyproject.toml requirements/robot.txt | .venv/bin/pip
	@echo "installing what FROG needs into .venv: 450 MB, about half a minute"
	$(INSTALL) --no-compile --require-hashes -r requirements/robot.txt
	$(INSTALL) --no-deps -e .
	@touch $@

.venv/ready: pyproject.toml requirements/dev.txt | .venv/bin/pip
	@echo "installing everything into .venv, tests and checks too: 910 MB, about a minute"
	$(INSTALL) --require-hashes -r requirements/dev.txt
	$(INSTALL) --no-deps -e .
	@touch .venv/frog $@

.venv/docs: pyproject.toml requirements/docs.txt | .venv/bin/pip
	$(INSTALL) --require-hashes -r requirements/docs.txt
	$(INSTALL) --no-deps -e .
	@touch .venv/frog $@

# What tests import is compiled as they import it, which is a fraction of the packages.
$(OTHER)/ready: pyproject.toml requirements/dev.txt
	$(PYTHON) -m venv $(OTHER)
	$(OTHER)/bin/pip install --quiet --disable-pip-version-check --no-compile --require-hashes -r requirements/dev.txt
	$(OTHER)/bin/pip install --quiet --disable-pip-version-check --no-deps -e .
	@touch $@

# Python 3.11's venv has setuptools, which FROG does not need.
.venv/bin/pip:
	$(PYTHON) -m venv .venv
	@$(BIN)/pip uninstall -qq --yes setuptools
