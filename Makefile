# `make demo` and `make test` need Python 3.11 or newer, git and make; they install everything else into .venv.

SHELL := /bin/bash
.DEFAULT_GOAL := help
PYTHON ?= $(firstword $(foreach p,python3.13 python3.12 python3.11 python3 python,$(shell $(p) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $(p))))
PYTHONS ?= 3.11 3.12 3.13
# Where Python may not keep what it compiled, every worker compiles all of it: 25 s instead of 9 s to find the tests.
export PYTHONDONTWRITEBYTECODE :=
# uv from PATH if it is there, else our own in .uv
UV ?= $(or $(shell command -v uv 2>/dev/null),.uv/bin/uv)
RUN := .venv/bin/
PROGRESS := bash .ci/progress
# pytest on every core; `PARALLEL=` for one core
PARALLEL ?= -n logical --maxprocesses 8 --dist worksteal
# folders of `make test`, all by default: make test TESTS="tests/bridge tests/protocol"
TESTS ?=
# per cent that `make cover` requires of these packages; make cover COVERED=0 COVERED_PACKAGES=bridge only prints
COVERED ?= 90
COVERED_PACKAGES ?= orchestrator protocol agents
# What people install is typed as macOS and Windows have it; tests skip there what they lack, and bench runs on Linux.
INSTALLED := agents bridge configs khala_sc2 orchestrator protocol simulator
# What `make wheels` builds, and where
DISTRIBUTIONS := khala-sc2 khala-sc2-agents khala-sc2-bridge khala-sc2-configs khala-sc2-orchestrator khala-sc2-protocol khala-sc2-simulator
DIST ?= dist

.PHONY: help install install-tests extras wheels check format types test test-rest pysc2 slow interpreted install-standards standards cover test-all demo bench limits scenarios docs golden page picture clean

help: ## List the targets
	@awk -F ':.*## ' '/^[a-z0-9-]+:.*## / {printf "  make %-10s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

.uv/bin/uv:
	@test -n "$(PYTHON)" || { echo "Khala needs Python 3.11 or newer: install it, or say make PYTHON=/path/to/python"; exit 1; }
	@echo "Installing uv, which installs everything else, into .uv"
	@$(PYTHON) -m venv .uv
	@.uv/bin/pip install --quiet --disable-pip-version-check 'uv>=0.9'

# A C compiler, where there is one, builds the simulator's compiled systems; see docs/design/engine.md.
ENGINE := simulator/pyproject.toml simulator/setup.py simulator/builder.py $(filter-out %/columns.pxd %/columns.pyx,$(wildcard simulator/khala_simulator/*/*.p*))

.venv/.ready: pyproject.toml uv.lock $(ENGINE) $(filter .uv/bin/uv,$(UV))
	@test -n "$(PYTHON)" || { echo "Khala needs Python 3.11 or newer: install it, or say make PYTHON=/path/to/python"; exit 1; }
	@$(PROGRESS) "Installing what a match needs into .venv: 110 packages, and a compiled simulator (a few minutes on two cores)" \
	  $(UV) sync --frozen --inexact --python $(PYTHON)
	@touch $@

.venv/.tests: .venv/.ready
	@$(PROGRESS) "Installing what the tests need into .venv" \
	  $(UV) sync --frozen --inexact --python $(PYTHON) --group env --group experiments --group page --group tools
	@touch $@

# Not every machine has a wheel of llama.cpp; the tests that need it are skipped there, and say so.
.venv/.real-model: .venv/.tests
	-$(UV) sync --quiet --frozen --inexact --python $(PYTHON) --group env --group experiments --group page --group tools --group real-model
	@touch $@

install: .venv/.ready ## Install what is needed to play into .venv

install-tests: .venv/.tests ## Install what the tests need as well

extras: install ## Install what environments, data sets, Inspect, `khala mcp` and `khala openenv` need as well
	$(UV) sync --quiet --frozen --inexact --python $(PYTHON) --extra data --extra env --extra inspect --extra mcp --extra openenv

wheels: $(filter .uv/bin/uv,$(UV)) ## Build a wheel of every distribution into dist/; make wheels PYTHON=python3.12 for another Python
	for distribution in $(DISTRIBUTIONS); do \
	  $(UV) build --quiet --wheel --python $(PYTHON) --package $$distribution --out-dir $(DIST) || exit 1; \
	done

demo: install ## Play a battle on this machine: simulator, host, two agents, scripted model; then without orders
	$(RUN)khala run 2s3z_pair --seed 2
	@echo "And now the same army without orders; of 20 seeds it won 3, and with orders 20:"
	$(RUN)khala run 2s3z_pair --seed 2 --policy silent
	@echo "Look at both battles: .venv/bin/khala view"

test: install-tests ## Lint, types, contracts and every short test
	@said=$$(mktemp) && trap 'rm -f $$said' EXIT; \
	$(MAKE) --no-print-directory check >$$said 2>&1 & checks=$$!; \
	$(RUN)pytest $(PARALLEL) $(TESTS); tests=$$?; \
	wait $$checks; checks=$$?; cat $$said; \
	[ $$tests = 0 ] || echo "make test: tests failed, see above the checks"; \
	[ $$checks = 0 ] || echo "make test: a check failed, it is the last one above"; \
	[ $$tests = 0 ] && [ $$checks = 0 ]

pysc2: install ## The long ones of PySC2's own game tests; `make test` runs the others
	$(RUN)pytest $(PARALLEL) -m slow tests/simulator/live/test_pysc2_own_tests.py

test-rest: TESTS = $(filter-out tests/__pycache__/ $(COVERED_PACKAGES:%=tests/%/),$(wildcard tests/*/))
test-rest: test ## `make test` without the folders that `make cover` plays

slow: install-tests .venv/.real-model ## All long tests: whole tables, more examples, those of PySC2, random agents, long games, every scenario
	$(RUN)pytest $(PARALLEL) -m "slow or hypothesis" --hypothesis-profile long

interpreted: install-tests ## Unit tests of the rules in the interpreter, as a debugger plays them
	KHALA_ENGINE=python $(RUN)pytest $(PARALLEL) tests/simulator/engine/test_damage.py tests/simulator/engine/test_weapons.py tests/simulator/engine/test_acquire.py tests/simulator/engine/test_regeneration.py tests/simulator/engine/test_melee_contact.py

# verifiers pins mcp 2.0.0, NeMo Gym mcp 1 and Python 3.13: each has an environment of its own, with Khala in it.
PYTHON_313 ?= $(firstword $(foreach p,python3.13 $(wildcard $(HOME)/.pyenv/versions/3.13*/bin/python3),$(shell $(p) -c 'import sys; sys.exit(sys.version_info[:2] != (3, 13))' 2>/dev/null && echo $(p))))

.venv-verifiers/.ready: envs/khala_verifiers/pyproject.toml uv.lock $(filter .uv/bin/uv,$(UV))
	@UV=$(UV) bash .ci/environment .venv-verifiers $(PYTHON) "verifiers>=0.4,<0.5"
	@$(UV) pip install --quiet --python .venv-verifiers/bin/python --no-deps -e envs/khala_verifiers

.venv-nemo-gym/.ready: envs/khala_nemo_gym/resources_servers/khala_starcraft/requirements.txt uv.lock $(filter .uv/bin/uv,$(UV))
	@test -n "$(PYTHON_313)" || { echo "NeMo Gym needs Python 3.13: say make standards PYTHON_313=/path/to/python3.13"; exit 1; }
	@UV=$(UV) bash .ci/environment .venv-nemo-gym $(PYTHON_313) --python-version 3.13.14 "nemo-gym>=0.7,<0.8"

install-standards: .venv-verifiers/.ready .venv-nemo-gym/.ready ## Install verifiers and NeMo Gym, without which `make slow` leaves out their checks

standards: install-tests install-standards ## The checks of verifiers and NeMo Gym, each in an environment of its own
	$(RUN)pytest -m "slow or not slow" tests/standards

cover: install-tests ## Branch coverage of packages by their own tests; fails below COVERED per cent
	rm -f .coverage .coverage.*
	$(RUN)pytest $(PARALLEL) --cov --cov-report= $(addprefix tests/,$(COVERED_PACKAGES))
	for package in $(COVERED_PACKAGES); do \
	  echo "== $$package"; $(RUN)coverage report --include "$$package/*" --skip-covered --fail-under $(COVERED) || exit 1; \
	done

check: install-tests ## Lint, format, types on three platforms, import contracts, rows of bench/doors for every command, and habits of the code
	$(RUN)ruff check .
	$(RUN)ruff format --check .
	$(RUN)mypy
	for platform in darwin win32; do $(RUN)mypy --platform $$platform --no-warn-unreachable --cache-dir .mypy_cache/$$platform $(INSTALLED) || exit 1; done
	$(RUN)lint-imports --no-logo
	$(RUN)python -m bench doors --check
	$(RUN)python -m bench house

format: install ## Format the code and fix what the linter can
	$(RUN)ruff format .
	$(RUN)ruff check --fix .

test-all: $(filter .uv/bin/uv,$(UV)) ## The tests on every Python: make test-all PYTHONS="3.12 /opt/python3.13/bin/python"
	@for wanted in $(PYTHONS); do \
	  python=$$($(UV) python find --no-python-downloads $$wanted 2>/dev/null) || { echo "== no Python $$wanted here"; continue; }; \
	  version=$$($$python -c 'import platform; print(platform.python_version())'); \
	  echo "== Python $$version"; \
	  export UV_PROJECT_ENVIRONMENT=.venv-$$version; \
	  $(UV) sync --quiet --frozen --python $$python --group env --group experiments --group tools && .venv-$$version/bin/pytest -q $(PARALLEL) || exit 1; \
	done

page: install ## Build khala_sc2/view/assets/index.html, the page of `khala view`, from page/; needs Node 20.19 or newer
	$(RUN)python -m page.typescript
	cd page && npm ci --silent --no-audit --no-fund && npm run --silent types && npm test --silent && npm run --silent build

bench: install ## Measure what docs/measurements.md claims
	$(RUN)python -m bench

limits: install ## Fail if a ratio that is measured within one run is beyond its limit
	$(RUN)python -m bench limits

scenarios: install ## Play all 33 maps of the paper with the scripted players, and write the table
	$(RUN)python -m bench scenarios

docs: install ## Write the generated pages of docs/reference, play the gallery, and build the site with search into site/
	$(RUN)python -m docs.generate
	$(RUN)python -m docs.gallery
	$(UV) sync --quiet --frozen --inexact --group docs
	NO_MKDOCS_2_WARNING=1 $(RUN)mkdocs build --strict --quiet

golden: install ## Record the tests' battle again, after an intended change
	rm -rf runs/golden
	$(RUN)khala run 2s3z_pair --model-name focus-fire --run golden --latency 0
	cp runs/golden/recording.mcap tests/khala/golden.mcap

picture: install ## Play a battle and draw docs/images/2s3z.webp from its recording
	$(RUN)python -m docs.picture

clean: ## Remove what make made
	rm -rf site docs/gallery .coverage .coverage.* .venv .venv-3.* .venv-verifiers .venv-nemo-gym .uv .mypy_cache .ruff_cache .pytest_cache .hypothesis dist
