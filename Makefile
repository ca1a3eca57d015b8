# Everything a person or CI does with this repository. `make help` lists it.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
export VIRTUAL_ENV := $(CURDIR)/$(VENV)

RUST := Cargo.toml Cargo.lock python/mpi_hyst/_types.py $(shell find crates -path '*/src/*.rs' -o -path '*/stub/*.rs' -o -name build.rs -o -name Cargo.toml)
# An environment that can build the package; in it, what tests and lint need.
MATURIN := $(VENV)/.maturin
TOOLS := $(VENV)/.tools
PACKAGE := $(VENV)/.package
BENCHES := $(VENV)/.benches
DOCS := $(VENV)/.docs
SITE := target/docs
TIMES := target/bench/python.json
# The library of functional mock-up units, which the Python package packs.
UNITS := $(VENV)/.units
PYTHON_CODE := python tests examples docs benches/python benches/benchmarks checks/fuzz
CAPI ?= target/capi

# Where cargo builds, and criterion and gungraun leave what they measured.
export CARGO_TARGET_DIR := $(CURDIR)/target
MEASURED := target/bench
REPORT := cargo run --quiet --release -p bench-report --
VALGRIND := $(shell command -v valgrind)
# gungraun starts its benches through a runner of exactly its own version.
GUNGRAUN := $(shell sed -n '/^name = "gungraun"$$/{n;s/.*"\(.*\)"/\1/p;}' Cargo.lock)
RUNNER := target/tools/gungraun-$(GUNGRAUN)/bin/gungraun-runner

.DEFAULT_GOAL := help
.PHONY: help demo package test test-rust test-python test-random coverage lint lint-rust lint-python bench bench-time bench-quick bench-instructions bench-latency \
	bench-check bench-reference bench-brief bench-python bench-identify bench-many bench-load-cells bench-places bench-foreign bench-random-cases bench-read bench-benchmarks capi fmu wheel wheel-try wheel-audit sdist-try lowest crates semver workflow licences realtime firmware header soak \
	fuzz mutants audit sbom kill-saves full-disk picture docs linkcheck linkcheck-web format clean
# Nothing else may run while something is timed.
.NOTPARALLEL:

help: ## list the targets
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 20

demo: $(PACKAGE) ## a measured stack, then the whole chain on the paper's actuator; leaves mpi-hyst-demo/report.html
	$(BIN)/mpi-hyst demo

# The same examples at the desk and in CI; `make test-random` draws others.
FIXED_SEED := 20170401

test: test-rust test-python ## every test

test-rust: export PROPTEST_RNG_SEED := $(FIXED_SEED)
test-rust: ## the Rust tests, the documentation's examples, the proofs that the core needs no std and no allocator and never panics
	cargo test --quiet --all-features
	cargo build --quiet --manifest-path checks/no-std/Cargo.toml --target-dir target/no-std
	cargo build --quiet --manifest-path checks/no-std/Cargo.toml --target-dir target/no-std --features alloc
	cargo run --quiet --release --manifest-path checks/no-panic/Cargo.toml --target-dir target/no-panic
	checks/firmware/run

package: $(PACKAGE) $(TOOLS) $(UNITS) capi $(DOCS) ## all that is built and installed for the Python tests and the pages

test-python: $(PACKAGE) $(TOOLS) $(UNITS) capi ## the Python tests against the compiled package, and the C library beside it
	$(BIN)/python -m pytest --numprocesses=2 --dist=loadfile

ifndef SEED
SEED := $(shell od -An -N4 -tu4 /dev/urandom | tr -d ' ')
endif
CASES ?= 2000

test-random: $(PACKAGE) $(TOOLS) $(UNITS) ## the laws on many more examples: SEED=n repeats a run, CASES=n sets how many the Rust tests draw
	@echo "make test-random SEED=$(SEED) CASES=$(CASES)"
	PROPTEST_RNG_SEED=$(SEED) PROPTEST_CASES=$(CASES) \
		cargo test --quiet --release --all-features --no-fail-fast
	$(BIN)/python -m pytest --numprocesses=2 --dist=loadfile --hypothesis-profile=random --hypothesis-seed=$(SEED) \
		-m 'slow or not slow'

SEEDS ?= 200

coverage: ## how often 95 % intervals of identified parameters hold the truth, over SEEDS records of every kind
	COVERAGE_SEEDS=$(SEEDS) cargo test --quiet --release -p hysteresis-identify --test all coverage -- --nocapture

FUZZ_SECONDS ?= 3600
FUZZ_TARGETS ?= stage_file saved_bytes steps c_interface record_reader
# Sanitizers and counters of coverage are unstable options of the compiler.
FUZZ := RUSTC_BOOTSTRAP=1 $(CURDIR)/target/tools/bin/cargo-fuzz

fuzz: $(addprefix fuzz-,$(FUZZ_TARGETS)) ## fuzz each of FUZZ_TARGETS for FUZZ_SECONDS, an hour by default; what is found lies in target/fuzz/found

fuzz-record_reader: $(PACKAGE) $(TOOLS)
	mkdir -p target/fuzz/corpus/record_reader target/fuzz/found
	$(BIN)/python -m pip install --quiet --group fuzz
	$(BIN)/python checks/fuzz/record_reader.py $(FUZZ_OPTIONS) -rss_limit_mb=4096 \
		target/fuzz/corpus/record_reader checks/fuzz/seeds/record_reader

fuzz-%: target/tools/bin/cargo-fuzz
	mkdir -p target/fuzz/corpus/$* target/fuzz/found
	cd checks/fuzz && env -u CARGO_TARGET_DIR $(FUZZ) run --fuzz-dir libfuzzer --target-dir ../../target/fuzz $* \
		../../target/fuzz/corpus/$* seeds/$* -- $(FUZZ_OPTIONS)

FUZZ_OPTIONS = -max_total_time=$(FUZZ_SECONDS) -timeout=60 -max_len=2000 -print_final_stats=1 \
	-artifact_prefix=$(CURDIR)/target/fuzz/found/$(@:fuzz-%=%)-

MUTANTS_OF ?= hysteresis-core
MUTANTS_SHARD ?= 0/1

mutants: target/tools/bin/cargo-mutants ## change MUTANTS_OF in every way of cargo-mutants, or a part of them, MUTANTS_SHARD=0/20, and see whether a test fails
	PROPTEST_RNG_SEED=$(FIXED_SEED) target/tools/bin/cargo-mutants mutants --package $(MUTANTS_OF) --all-features --shard $(MUTANTS_SHARD) \
		--sharding round-robin --timeout 300 --output target/mutants

audit: target/tools/bin/cargo-deny ## licences, bans and sources of what is linked
	target/tools/bin/cargo-deny --all-features check bans licenses sources

sbom: target/tools/bin/cargo-cyclonedx ## what the package and the C library are made of: target/sbom
	mkdir -p target/sbom
	for crate in python capi; do \
		target/tools/bin/cargo-cyclonedx cyclonedx --manifest-path crates/hysteresis-$$crate/Cargo.toml --format json \
			--override-filename mpi_hyst-$$crate.cdx || exit 1; \
		mv crates/hysteresis-$$crate/mpi_hyst-$$crate.cdx.json target/sbom/ || exit 1; done

target/tools/bin/cargo-%:
	cargo install --quiet --locked --root target/tools cargo-$*

lint: lint-rust lint-python ## formatting, clippy, documentation, ruff, mypy, stubtest

lint-rust:
	cargo fmt --all --check
	cargo clippy --quiet --workspace --all-targets --all-features -- -D warnings
	cargo clippy --quiet -p hysteresis-core --no-default-features -- -D warnings
	RUSTDOCFLAGS="-D warnings" cargo doc --quiet --workspace --no-deps --all-features

lint-python: $(PACKAGE) $(TOOLS)
	$(BIN)/ruff check $(PYTHON_CODE)
	$(BIN)/ruff format --check $(PYTHON_CODE)
	$(BIN)/mypy
	$(BIN)/python -m mypy.stubtest mpi_hyst._core

bench: bench-time bench-instructions bench-latency ## time, instructions and latency per sample: a table and target/bench/results.json
	$(REPORT) gather
	$(REPORT) show

# Times the cases whose names match a pattern, or all.
define TIME
rm -rf target/criterion
@cargo bench --quiet -p hysteresis-bench --bench time -- '$(1)' > $(MEASURED)/time.txt 2>&1 || \
	{ tail -n 20 $(MEASURED)/time.txt >&2; false; }
endef

bench-time: | $(MEASURED)
	@echo "timing, about five minutes"
	$(call TIME)

# Of step and run with 20 operators on the sine, the sine with noise and white noise.
QUICK := ^(sine|noisy-sine|white)/.*-(step|run)/20$$
bench-quick: | $(MEASURED) ## time per sample of 20 operators alone, beside the loops, in less than a minute
	$(call TIME,$(QUICK))
	@$(REPORT) times

bench-latency: | $(MEASURED)
	$(REPORT) latency

bench-instructions: $(if $(VALGRIND),$(RUNNER)) | $(MEASURED) ## instructions per sample alone, counted by valgrind
	rm -rf target/gungraun
ifdef VALGRIND
	@echo "counting instructions, about four minutes"
	@GUNGRAUN_RUNNER=$(CURDIR)/$(RUNNER) cargo bench --quiet -p hysteresis-bench --bench instructions -- \
		--save-summary=json --parallel=auto > $(MEASURED)/instructions.txt
	@$(REPORT) instructions
else
	@echo "warning: valgrind is not installed, instructions are NOT counted" >&2
endif

bench-check: bench ## warns of what costs more than in benches/reference.json, and fails if anything does
	@$(REPORT) check

bench-reference: bench ## makes this run the reference
	cp $(MEASURED)/results.json benches/reference.json

bench-brief: ## the last run, or else the reference, as both READMEs show it
	@$(REPORT) show --readme $(firstword $(wildcard $(MEASURED)/results.json) benches/reference.json)
	@$(REPORT) show --brief $(firstword $(wildcard $(MEASURED)/results.json) benches/reference.json)

bench-python: $(PACKAGE) $(BENCHES) ## time of the Python faces beside numba and numpy loops
	@mkdir -p $(dir $(TIMES))
	$(BIN)/python -m pytest benches/python --benchmark-group-by=group --benchmark-json=$(TIMES) \
		--benchmark-columns=min,median,max,rounds --benchmark-sort=name
	$(BIN)/python benches/python/ratios.py $(TIMES)

bench-identify: $(PACKAGE) $(TOOLS) ## time of identifying one record of 12 000 and of a million samples, and experiments of 100 000 and 340 000
	PYTHONPATH=tests $(BIN)/python benches/python/identify.py $(IDENTIFY)

bench-many: $(PACKAGE) $(TOOLS) ## time and accuracy of identifying 4096 actuators at once, beside single fits
	$(BIN)/python benches/python/many.py $(MANY)

bench-load-cells: $(PACKAGE) $(TOOLS) ## what a calibration by known loads leaves of the error of simulated load cells: a minute or two
	PYTHONPATH=examples $(BIN)/python benches/python/load_cells.py $(CELLS)

bench-places: $(PACKAGE) $(TOOLS) ## where a stage is that was identified without a position sensor: about two minutes
	PYTHONPATH=tests $(BIN)/python benches/python/places.py

bench-foreign: $(PACKAGE) $(TOOLS) ## what is left of the error on stages of other physics, beside simple models: about ten minutes; FOREIGN="--records triangles" for a part
	PYTHONPATH=tests $(BIN)/python benches/python/foreign_stages.py $(FOREIGN)

bench-random-cases: $(PACKAGE) $(TOOLS) ## whether verdicts and promised errors hold on random records of the stages of bench-foreign: about ten minutes; RANDOM_CASES="--cases 20" for some
	PYTHONPATH=tests $(BIN)/python benches/python/random_cases.py $(RANDOM_CASES)

bench-read: $(PACKAGE) $(TOOLS) ## time and memory of reading a CSV of 1 GB beside polars; READ="--size 0.3" for 0.3 GB
	$(BIN)/python benches/python/read.py $(READ)

bench-benchmarks: $(PACKAGE) $(TOOLS) ## public benchmarks beside published figures; BOUC_WEN="--official FOLDER" and MIRROR="--official FOLDER" for the official files
	$(BIN)/python benches/benchmarks/bouc_wen.py $(BOUC_WEN)
	$(BIN)/python benches/benchmarks/steering_mirror.py $(MIRROR)

# Only what others link: for a Rust library too, all crates below would be compiled to machine code once more.
capi: ## the C library, its header and its pkg-config file, in the folder CAPI (target/capi)
	cargo rustc --quiet --release -p hysteresis-capi --lib --crate-type=staticlib,cdylib
	mkdir -p $(CAPI)/include $(CAPI)/lib/pkgconfig
	cp crates/hysteresis-capi/include/mpi_hyst.h $(CAPI)/include
	for library in libmpi_hyst.a libmpi_hyst.so libmpi_hyst.dylib; do \
		if test -e target/release/$$library; then cp target/release/$$library $(CAPI)/lib || exit 1; fi; done
	version=$$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml) && \
		sed "s/@VERSION@/$$version/" crates/hysteresis-capi/mpi_hyst.pc.in > $(CAPI)/lib/pkgconfig/mpi_hyst.pc

fmu: $(UNITS) ## the library of functional mock-up units, which the Python package holds

RATE ?= 10000
SECONDS ?= 60

realtime: $(PACKAGE) $(TOOLS) ## a loop on the clock of this machine: RATE samples per second for SECONDS; what it took and missed, then a loop in Python, and this loop around an object in Python
	cargo run --quiet --release -p hysteresis-realtime --example loop -- --rate $(RATE) --seconds $(SECONDS) $(OPTIONS)
	$(BIN)/python benches/python/realtime.py $(RATE) $(SECONDS)

firmware: ## streams of fixed size on a Cortex-M4F in qemu: the bits of this machine, and instructions per sample
	checks/firmware/run

KILLS ?= 200
KILL_SEED ?= 1

kill-saves: $(PACKAGE) $(TOOLS) ## KILLS processes killed while they save: the old file or the new one is there, nothing is left for long
	$(BIN)/python tests/killed_saves.py $(KILLS) $(KILL_SEED)

full-disk: $(PACKAGE) $(TOOLS) $(UNITS) ## every writing command and save() where the disk is full: one line, nothing half-written
	$(BIN)/python tests/full_disk.py

# Neither the folders of this machine nor those of its tools are in what others get. Built apart, as other flags build all anew.
WHEEL_FLAGS = --remap-path-prefix=$(CURDIR)=. --remap-path-prefix=$(or $(CARGO_HOME),$(HOME)/.cargo)=cargo

wheel: $(MATURIN) ## the wheel for this system, with all licences and without paths of this machine, in target/wheel/dist
	rm -rf target/wheel/dist
	RUSTFLAGS="$(WHEEL_FLAGS)" CARGO_TARGET_DIR=$(CURDIR)/target/wheel $(PYTHON) docs/make_units.py
	RUSTFLAGS="$(WHEEL_FLAGS)" $(BIN)/maturin build --quiet --release --target-dir target/wheel --out target/wheel/dist
	$(BIN)/python tests/check_wheel.py target/wheel/dist/*.whl $(CURDIR) $(or $(CARGO_HOME),$(HOME)/.cargo)

wheel-try: wheel ## install that wheel in an empty environment, without Rust on the path, and run the demo there
	$(PYTHON) -m venv --clear target/wheel/venv
	target/wheel/venv/bin/python -m pip install --quiet "$$(ls $(CURDIR)/target/wheel/dist/*.whl)[cli,report]"
	mkdir -p target/wheel/try
	cd target/wheel/try && PATH=/usr/bin:/bin ../venv/bin/mpi-hyst demo

wheel-audit: wheel ## does that wheel keep the stable ABI of Python that its name promises, and the age of Linux
	$(BIN)/python -m pip install --quiet --group audit
	$(BIN)/abi3audit --strict target/wheel/dist/*.whl
	if test "$$(uname)" = Linux; then PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/python tests/check_platform.py target/wheel/dist/*.whl; fi

sdist-try: $(MATURIN) ## the source distribution; install from it in an empty environment, and run the demo there
	rm -rf target/sdist
	$(BIN)/maturin sdist --manifest-path crates/hysteresis-python/Cargo.toml --out target/sdist
	$(PYTHON) -m venv --clear target/sdist/venv
	target/sdist/venv/bin/python -m pip install --quiet "$$(ls $(CURDIR)/target/sdist/*.tar.gz)[cli,report]"
	mkdir -p target/sdist/try
	cd target/sdist/try && ../venv/bin/mpi-hyst demo

lowest: wheel ## the Python tests with the oldest versions of numpy and of the extras that pyproject.toml allows
	$(PYTHON) -m venv --clear target/lowest
	$(PYTHON) docs/lowest_versions.py > target/lowest/constraints.txt
	target/lowest/bin/python -m pip install --quiet 'pip>=25.1'
	target/lowest/bin/python -m pip install --quiet --constraint target/lowest/constraints.txt --group test \
		"$$(ls $(CURDIR)/target/wheel/dist/*.whl)[all]"
	# Old libraries use what newer ones, on which they stand, no longer like.
	target/lowest/bin/python -m pytest --numprocesses=2 --dist=loadfile -W ignore::DeprecationWarning $(LOWEST_OPTIONS)

CRATES := core control simulate identify realtime export

crates: ## pack the crates as for the registry, and build each from what was packed
	cargo package --quiet $(CRATES:%=--package hysteresis-%) --target-dir target/crates

SEMVER_BASE ?= $(shell git describe --tags --abbrev=0 --match 'v*' 2>/dev/null)

semver: target/tools/bin/cargo-semver-checks ## does the Rust interface keep what it promised at SEMVER_BASE, by default the last release
	$(if $(SEMVER_BASE),,$(error SEMVER_BASE: expected a commit or tag, as there is no release yet: make semver SEMVER_BASE=...))
	target/tools/bin/cargo-semver-checks semver-checks --baseline-rev $(SEMVER_BASE) $(CRATES:%=--package hysteresis-%)

workflow: $(TOOLS) ## write the workflow of a release anew
	PATH="$(CURDIR)/$(BIN):$$PATH" $(PYTHON) docs/make_workflow.py

licences: ## write the licences of all linked crates anew
	$(PYTHON) docs/make_licences.py

header: ## write the header of the C library anew from its sources
	UPDATE_HEADER=1 cargo test --quiet -p hysteresis-capi --test all header

soak: ## 1e9 mixed samples through an inverse and its actuator: no drift; 1e7 of every loop: no drive beyond limits or slew
	cargo run --quiet --release -p soak -- $(SAMPLES)

picture: $(PACKAGE) $(TOOLS) ## draw the pictures of the README and the pages
	$(BIN)/python docs/make_picture.py
	$(BIN)/python docs/plot_cost.py
	$(BIN)/python docs/make_drawings.py

docs: $(PACKAGE) $(DOCS) $(UNITS) ## the pages of docs, every code cell run anew: target/docs/index.html; warnings are errors
	rm -rf $(SITE) target/docs-doctrees docs/auto_gallery
	$(BIN)/sphinx-build -q -j auto -W --keep-going -b html -d target/docs-doctrees docs $(SITE)
	RUSTDOCFLAGS="-D warnings" cargo doc --quiet --workspace --no-deps --all-features
	cp -R target/doc $(SITE)/rust

linkcheck: docs ## every link and anchor of target/docs that leads into it; nothing is loaded from elsewhere
	$(BIN)/python docs/check_links.py $(SITE)

linkcheck-web: $(PACKAGE) $(DOCS) $(UNITS) ## links of the pages to other sites; needs the network
	$(BIN)/sphinx-build -q -b linkcheck -D nb_execution_mode=off -D plot_gallery=0 docs target/docs-linkcheck

format: $(TOOLS) ## format all code
	cargo fmt --all
	$(BIN)/ruff format $(PYTHON_CODE)
	$(BIN)/ruff check --fix $(PYTHON_CODE)

clean: ## remove all that was built
	rm -rf target $(VENV) docs/auto_gallery mpi-hyst-demo mpi-hyst-reproduce dist python/mpi_hyst/*.so python/mpi_hyst/_fmu/binaries

$(MEASURED):
	mkdir -p $@

$(RUNNER):
	cargo install --quiet --locked --root target/tools/gungraun-$(GUNGRAUN) --version =$(GUNGRAUN) gungraun-runner

$(MATURIN):
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade 'pip>=25.1' 'maturin>=1.9.4,<2'
	@touch $@

$(TOOLS): $(MATURIN) pyproject.toml
	$(BIN)/python -m pip install --quiet --group test
	@$(BIN)/python -m pip install --quiet --group integrations || \
		echo "warning: libraries of the examples are missing, tests of these examples are LEFT OUT" >&2
	@touch $@

$(DOCS): $(TOOLS)
	$(BIN)/python -m pip install --quiet --group docs
	@touch $@

$(BENCHES): $(TOOLS)
	$(BIN)/python -m pip install --quiet --group bench
	@touch $@

# Cargo knows what has changed; without symbols it is a quarter of the size.
$(UNITS): $(MATURIN) $(RUST) docs/make_units.py
	$(PYTHON) docs/make_units.py
	@touch $@

$(PACKAGE): $(MATURIN) $(RUST) pyproject.toml
	$(BIN)/maturin develop --quiet --release --extras cli,report
	@touch $@
