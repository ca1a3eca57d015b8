# Everything a person or CI does with this repository. `make help` lists it.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
export VIRTUAL_ENV := $(CURDIR)/$(VENV)

RUST := Cargo.toml Cargo.lock $(shell find crates benches -name '*.rs' -o -name Cargo.toml)
TOOLS := $(VENV)/.tools
PACKAGE := $(VENV)/.package
BENCHES := $(VENV)/.benches
TIMES := target/bench/python.json
PYTHON_CODE := python tests docs benches/python

.DEFAULT_GOAL := help
.PHONY: help demo test test-rust test-python lint lint-rust lint-python bench bench-python soak picture format clean

help: ## list the targets
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 16

demo: $(PACKAGE) ## the whole chain on the paper's actuator; leaves mpi-hyst-demo/report.html
	$(BIN)/mpi-hyst demo

test: test-rust test-python ## every test

test-rust: ## the Rust tests, the documentation's examples and the proof that the core needs no std
	cargo test --quiet --workspace --exclude hysteresis-python --all-features
	cargo build --quiet --manifest-path checks/no-std/Cargo.toml --target-dir target/no-std

test-python: $(PACKAGE) ## the Python tests against the compiled package
	$(BIN)/python -m pytest

lint: lint-rust lint-python ## formatting, clippy, documentation, ruff, mypy, stubtest

lint-rust:
	cargo fmt --all --check
	cargo clippy --quiet --workspace --all-targets --all-features -- -D warnings
	RUSTDOCFLAGS="-D warnings" cargo doc --quiet --workspace --exclude hysteresis-python --no-deps --all-features

lint-python: $(PACKAGE)
	$(BIN)/ruff check $(PYTHON_CODE)
	$(BIN)/ruff format --check $(PYTHON_CODE)
	$(BIN)/mypy
	$(BIN)/python -m mypy.stubtest mpi_hyst._core

bench: ## time per sample beside a plain loop over operators
	cargo bench --quiet -p hysteresis-bench
	cargo run --quiet --release -p hysteresis-bench --bin bench-table

bench-python: $(PACKAGE) $(BENCHES) ## time of the Python faces beside numba and numpy loops
	@mkdir -p $(dir $(TIMES))
	$(BIN)/python -m pytest benches/python --benchmark-group-by=group --benchmark-json=$(TIMES) \
		--benchmark-columns=min,median,max,rounds --benchmark-sort=name
	$(BIN)/python benches/python/ratios.py $(TIMES)

soak: ## a thousand million mixed samples through an inverse and its actuator: no drift
	cargo run --quiet --release -p soak -- $(SAMPLES)

picture: $(PACKAGE) ## draw the picture of the README
	$(BIN)/python docs/make_picture.py

format: $(TOOLS) ## format all code
	cargo fmt --all
	$(BIN)/ruff format $(PYTHON_CODE)
	$(BIN)/ruff check --fix $(PYTHON_CODE)

clean: ## remove all that was built
	rm -rf target $(VENV) mpi-hyst-demo python/mpi_hyst/*.so

$(TOOLS): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade 'pip>=25.1' 'maturin>=1.9.4,<2'
	$(BIN)/python -m pip install --quiet --group test
	@touch $@

$(BENCHES): $(TOOLS)
	$(BIN)/python -m pip install --quiet --group bench
	@touch $@

$(PACKAGE): $(TOOLS) $(RUST) pyproject.toml
	$(BIN)/maturin develop --quiet --release --extras cli,report
	@touch $@
