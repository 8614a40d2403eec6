# The one list of what can be done here; CI and people call the same targets.
SHELL := /bin/bash
.DEFAULT_GOAL := help
.PHONY: help setup build demo test test-slow test-portable lint deny fmt bench docs

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# What tests build: all but what only timing needs. The bindings (tested from Python) are among them so that they and the
# tests ask for the same features of what all depend on, which is then built once.
CORE := --workspace --exclude groma-benches
SOURCES := $(shell find crates -name '*.rs' -o -name Cargo.toml) Cargo.toml pyproject.toml

help: ## show this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## /{printf "  make %-13s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

$(VENV)/.tools: pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || { echo "groma needs Python >= 3.11: set PYTHON=..."; exit 1; }
	@command -v cargo >/dev/null || { echo "groma needs Rust: cargo is not on the path"; exit 1; }
	@command -v cc >/dev/null || { echo "groma needs a C compiler: cc is not on the path"; exit 1; }
	@command -v cmake >/dev/null || { echo "groma needs cmake: it is not on the path"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade 'pip>=25.1'
	$(BIN)/python -m pip install --quiet --group dev
	@touch $@

$(VENV)/.built: $(VENV)/.tools $(SOURCES)
	PIP_QUIET=1 VIRTUAL_ENV=$(abspath $(VENV)) $(BIN)/maturin develop --profile release --generate-stubs --quiet --extras vision,link
	@touch $@

setup: $(VENV)/.tools ## make .venv with the tools
build: $(VENV)/.built ## build the extension and install groma into .venv

demo: build ## show what groma does on simulated recordings
	$(BIN)/groma demo

test: build ## all quick tests: Rust, then Python
	cargo test --release --quiet $(CORE)
	$(BIN)/pytest -n auto --dist loadfile -m 'not slow'

test-slow: build ## the statistics that take minutes
	cargo test --release $(CORE) -- --ignored
	$(BIN)/pytest -m slow

test-portable: build ## the quick tests as on processors without AVX-512, and without AVX2
	@for hidden in avx512 avx2; do \
	  CARGO_TARGET_X86_64_UNKNOWN_LINUX_GNU_RUNNER="$(BIN)/python $(CURDIR)/scripts/older_processor.py $$hidden" \
	    cargo test --release --quiet $(CORE) || exit 1; \
	  $(BIN)/python scripts/older_processor.py $$hidden $(BIN)/pytest -p no:faulthandler -n auto --dist loadfile -m 'not slow' || exit 1; \
	done

lint: build ## every lint is an error
	cargo fmt --all --check
	cargo clippy --release --workspace --all-targets --quiet -- -D warnings
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/lint-imports
	$(BIN)/mypy
	$(BIN)/python scripts/words.py

deny: ## licences, advisories and sources of the Rust dependencies (deny.toml; needs cargo-deny)
	@cargo deny --version >/dev/null 2>&1 || { echo "make deny needs cargo-deny: cargo install cargo-deny --locked"; exit 1; }
	cargo deny --workspace check

fmt: $(VENV)/.tools ## format everything
	cargo fmt --all
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

docs: build ## renew docs/reference/cli.md and findings.md, build rustdoc, run the lines of the documents and check their links
	$(BIN)/python scripts/cli_page.py
	$(BIN)/python scripts/findings_page.py
	RUSTDOCFLAGS='-D warnings' cargo doc --release --quiet --no-deps --workspace
	$(BIN)/pytest tests/test_docs.py

bench: build ## time FALKO, the pose graph (beside GTSAM) and groma map on all simulated scenes
	cargo bench --quiet -p groma-benches --bench features
	$(BIN)/python -m pip install --quiet --group oracle
	$(BIN)/python benches/pose_graph.py $(wildcard ../shared/data/posegraph/*.g2o.gz)
	$(BIN)/python benches/simulated.py
