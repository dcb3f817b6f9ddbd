# `make demo` and `make test` are all that a fresh machine with Python 3.11 or newer needs.
# The virtual environment is made on the first call and again when pyproject.toml or constraints.txt change.

PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
# Byte code is left to the first import of a module: most modules that are installed are never imported.
INSTALL := $(BIN)/python -m pip -qq --disable-pip-version-check install --no-compile
DEMO_OUT ?= runs/demo
# One process of tests a core, which computes with one thread; whoever is done first takes over tests of the others.
PYTEST_WORKERS ?= auto
PYTEST_OPTIONS ?=

.PHONY: demo test check bench faults site
.DELETE_ON_ERROR:

demo: $(VENV)/.ready
	$(BIN)/wsm demo --out $(DEMO_OUT)

# Byte code is written even where a container forbids it: hundreds of processes import the same modules.
test: $(VENV)/.ready-dev
	PYTHONDONTWRITEBYTECODE= OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n $(PYTEST_WORKERS) --dist worksteal $(PYTEST_OPTIONS)

check: $(VENV)/.ready-dev
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# The documentation as a site, in build/site; what a page links to must be there.
site: $(VENV)/.ready-dev
	$(BIN)/python docs/site/build.py

# Kills, damages and mishaps in full number; what was planted is counted at the end.
faults: $(VENV)/.ready-dev
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest tests/faults -m "slow or not slow"

bench: $(VENV)/.ready-bench
	@set -e; for program in $$(grep -l __main__ bench/*.py); do echo "$$program"; $(BIN)/python "$$program"; done

# Each stamp is newer than the files that decided what was installed. Torch, by far the largest package, has a stamp of
# its own; its version, like every other, stands in constraints.txt alone.
$(VENV)/.ready: $(VENV)/.torch pyproject.toml
	@echo "installing wsm"
	@$(INSTALL) -c constraints.txt -e .
	@touch $@

$(VENV)/.ready-dev: $(VENV)/.torch pyproject.toml
	@echo "installing wsm with its development tools"
	@$(INSTALL) -c constraints.txt -e '.[dev]'
	@touch $(VENV)/.ready $@

$(VENV)/.ready-bench: $(VENV)/.torch pyproject.toml
	@echo "installing wsm with the peers it is measured against"
	@$(INSTALL) -c constraints.txt -e '.[bench]'
	@touch $(VENV)/.ready $@

$(VENV)/.torch: $(VENV)/.made constraints.txt
	@echo "installing torch"
	@$(INSTALL) "$$(grep '^torch==' constraints.txt)"
	@touch $@

$(VENV)/.made:
	@$(PYTHON) -c 'import sys; sys.exit(None if sys.version_info >= (3, 11) else "wsm needs Python 3.11 or newer, found " \
		+ sys.version.split()[0] + "; name another one with: make PYTHON=python3.12 ...")'
	@echo "making the virtual environment $(VENV)"
	@$(PYTHON) -m venv $(VENV)
	@touch $@
