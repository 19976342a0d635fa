# Everything from a fresh checkout: `make demo` and `make test` each set up all that they need. What
# must be there already is Python, cargo with a C linker, and make; the rest comes from
# requirements.lock by plain pip, into .venv.

VENV := .venv
BIN := $(VENV)/bin
MACHINE := machines/planar_two_slider.toml
REPORT := build/planar_two_slider.html

# Stamps: what they stand for is up to date while they are newer than what it is made from.
MADE := $(VENV)/.made
PACKAGE := $(VENV)/.package
TOOLS := $(VENV)/.tools
BUILDERS := $(VENV)/.builders
KLIPPER := build/klipper/.made
CONSTRAINTS := build/constraints.txt
RELEASE_TOOLS := build/release/tools/.made
ACTIONLINT := build/release/actionlint-1.7.12/actionlint

RUST_SOURCES := Cargo.toml Cargo.lock rust-toolchain.toml $(shell find crates -name '*.rs' -o -name Cargo.toml)
KERNEL := $(wildcard python/truepose/_kernel*.so)

# The kernel for pages: Rust's names of where it runs and is tested, and the file of the package.
WEB_TARGET := wasm32-unknown-unknown
WASI_TARGET := wasm32-wasip1
WEB_KERNEL := python/truepose/_kernel.wasm.gz

# Byte code is kept, whatever the shell says: without it every start compiles the sources anew.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:

.PHONY: help
help: ## say what can be made
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/make \1|\2/p' Makefile | awk -F'|' '{ printf "%-21s %s\n", $$1, $$2 }'

# ---- what users run ----

.PHONY: demo
demo: package ## build, evaluate the planar machine and write its report
	@mkdir -p $(dir $(REPORT))
	$(BIN)/truepose report $(MACHINE) --output $(REPORT)
	@echo "The report is $(CURDIR)/$(REPORT): open it in a browser."

.PHONY: package
package: $(PACKAGE) web ## build the kernel and install truepose into .venv

# Without Rust's library for it a checkout does without, and its reports are static; the CI does not.
# The environment is made before the make within is started: two makes side by side would both make it.
.PHONY: web
web: cargo $(BUILDERS) ## build the kernel for pages, where Rust has its target: rustup target add wasm32-unknown-unknown
	@if [ -d "$$(rustc --print target-libdir --target $(WEB_TARGET))" ]; then \
		$(MAKE) --no-print-directory $(WEB_KERNEL); \
	else \
		echo "make: no live pages, for Rust lacks their target: rustup target add $(WEB_TARGET)" >&2; \
		test -z "$$TRUEPOSE_CI"; \
	fi

# ---- what developers run, and the CI ----

.PHONY: test
test: test-rust test-python ## run the tests, of each sweep a member or a few: minutes

# The CI has an hour: it does without the kernel's own tests on WebAssembly, which take minutes to compile, and
# without the members marked `long` of sweeps; the others of sweeps come last, and are skipped when the hour is over.
.PHONY: test-all
test-all: test-rust test-python-all $(if $(TRUEPOSE_CI),,test-wasi) ## run every test there is; the CI all but test-wasi and what is marked long

.PHONY: test-rust
test-rust: cargo $(MADE) ## run the kernel's tests
	$(CARGO) test --workspace --profile tests --locked

.PHONY: test-wasi
test-wasi: cargo ## run the kernel's tests on WebAssembly under Node.js: rustup target add wasm32-wasip1
	@if [ -d "$$(rustc --print target-libdir --target $(WASI_TARGET))" ] && command -v node >/dev/null; then \
		CARGO_TARGET_WASM32_WASIP1_RUNNER="node --no-warnings $(abspath tests/web/wasi.mjs)" \
			cargo test --package truepose-kernel --target $(WASI_TARGET) --release --locked; \
	else \
		echo "make: no tests on WebAssembly: they need Node.js and rustup target add $(WASI_TARGET)" >&2; \
	fi

.PHONY: test-python
test-python: package tools ## run the package's tests, of each sweep a member or a few
	$(PYTEST) -m "not sweep"

.PHONY: test-python-all
test-python-all: package tools ## run all of the package's tests, and write what they found for the site
ifdef TRUEPOSE_CI
	$(PYTEST) -m "not sweep"
	$(PYTEST) -m "sweep and not long"
else
	$(PYTEST) --results=build/test-results.json
endif

# Needs chromium. How long, and by which numbers drawn at random: make soak MINUTES=10 SEED=2.
MINUTES := 60
SEED := 1

.PHONY: soak
soak: package tools ## let the studio and its page work at random for an hour, and look at their memory
	PYTHONPATH=tests:. $(BIN)/python -m studio_soak --minutes $(MINUTES) --seed $(SEED)

.PHONY: klipper
klipper: $(KLIPPER) ## fetch and build Klipper's kinematics, with which tests compare, into build/klipper

.PHONY: lint
lint: lint-python lint-types lint-imports lint-rust ## check form, types and the direction of imports

.PHONY: lint-python
lint-python: tools
	$(BIN)/ruff check
	$(BIN)/ruff format --check

.PHONY: lint-types
lint-types: tools
	$(BIN)/mypy

.PHONY: lint-imports
lint-imports: tools
	PYTHONPATH=python $(BIN)/lint-imports

.PHONY: lint-rust
lint-rust: cargo $(MADE)
	$(CARGO) fmt --all --check
	$(CARGO) clippy --workspace --all-targets --locked -- -D warnings

.PHONY: format
format: tools ## put Python and Rust sources into form
	$(BIN)/ruff check --fix --select I
	$(BIN)/ruff format
	cargo fmt --all

# What is measured: `make bench ONLY="bounds gcode"` some, replacing their rows only; without it all but
# what takes minutes. Byte code and the kernel are built before.
ONLY :=

.PHONY: bench
bench: package tools ## measure, and write benchmarks/RESULTS.md; ONLY=name measures one alone
	$(BIN)/python -m benchmarks $(ONLY)

.PHONY: bench-region
bench-region: package tools ## measure bounds over the delta's cubes, which takes minutes
	$(BIN)/python -m benchmarks bounds_region

.PHONY: bench-against
bench-against: package tools ## build COMMIT=sha beside this one and write the ratios to it, benchmarks/AGAINST.md
	@test -n "$(COMMIT)" || { echo "say which commit: make bench-against COMMIT=sha" >&2; exit 1; }
	PYO3_PYTHON=$(abspath $(BIN)/python) $(BIN)/python -m benchmarks.against $(COMMIT) $(ONLY)

.PHONY: bench-peers
bench-peers: package tools $(CONSTRAINTS) ## install what benchmarks/peers.py compares with, Numba and JAX, into .venv
	$(BIN)/python -m pip install --quiet --constraint $(CONSTRAINTS) --requirement benchmarks/requirements-peers.txt

.PHONY: docs
docs: package tools ## write the generated pages of docs/ anew; tests refuse stale ones
	for page in docs/generate_*.py; do $(BIN)/python $$page || exit 1; done

.PHONY: site
site: package tools ## build the site into build/site; it opens from disk
	$(BIN)/python docs/site/build.py

.PHONY: site-release
site-release: package tools ## the same, and refuse results of tests that are not this commit's
	$(BIN)/python docs/site/build.py --release

.PHONY: lock
lock: tools ## resolve requirements.lock anew from pyproject.toml, and what wheels are built with
	$(COMPILE) --all-extras --output-file requirements.lock pyproject.toml
	$(COMPILE) --output-file release/requirements.txt release/requirements.in

# ---- what releases are made with: release/README.md ----

# Names of release/targets.py, or `sdist`: `make wheels ONLY=manylinux-x86_64`.
.PHONY: wheels
wheels: cargo web $(RELEASE_TOOLS) ## build wheels for Linux on x86-64 and ARM, and the sdist, into dist/: minutes each
	$(dir $(RELEASE_TOOLS))bin/python -m release.build $(ONLY)

# TRY="FILE ... --python PYTHON ...": of dist/ some files, with several Pythons.
.PHONY: wheels-test
wheels-test: $(MADE) ## try each file of dist/ in a clean environment on every library machine: minutes each
	$(BIN)/python -m release.try_wheels $(TRY)

.PHONY: names
names: tools ## write the names of CITATION.cff where they are wanted besides
	$(BIN)/python -m release.names

.PHONY: release-check
release-check: tools ## say what stands against a release; TAG=v1.2.3 that asks for it
	$(BIN)/python -m release.check $(if $(TAG),--tag $(TAG))

.PHONY: recipe
recipe: tools ## write dist/recipe.yaml, for conda-forge, from the sdist in dist/
	$(BIN)/python -m release.conda

.PHONY: change-report
change-report: package tools ## say what this branch does to public names and to speed since COMMIT=sha
	@test -n "$(COMMIT)" || { echo "say since which commit: make change-report COMMIT=sha" >&2; exit 1; }
	PYO3_PYTHON=$(abspath $(BIN)/python) $(BIN)/python -m release.change_report $(COMMIT) $(if $(OUTPUT),--output $(OUTPUT))

# Where Go is; elsewhere the test of the workflows does without it.
.PHONY: lint-workflows
lint-workflows: $(ACTIONLINT) ## check .github/workflows with actionlint
	$(ACTIONLINT)

.PHONY: audit
audit: $(RELEASE_TOOLS) ## look for known faults of what is depended on, and at licences; needs cargo-deny
	$(dir $(RELEASE_TOOLS))bin/pip-audit --strict --require-hashes --disable-pip --requirement requirements.lock
	cargo deny --locked check

.PHONY: tools
tools: $(TOOLS)

.PHONY: clean
clean: ## remove what was built
	rm -rf build target dist .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache $(PACKAGE)
	rm -f python/truepose/_kernel*.so $(WEB_KERNEL)
	find python tests benchmarks -name __pycache__ -type d -prune -exec rm -rf {} +

.PHONY: distclean
distclean: clean ## remove the virtual environment too
	rm -rf $(VENV)

# ---- how it is made ----

# A worker for each core, which therefore starts no threads of its own, neither the kernel's nor those of
# linear algebra. A file goes to one worker whole, with what its tests share; in the order of their names,
# so that the many short files of tests/unit, which come last, leave no worker idle.
PYTEST := TRUEPOSE_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest \
	--numprocesses=auto --dist=loadfile --no-loadscope-reorder

UV := 0.13.9

# Pins of what is locked, and hashes of all files that a pin has.
COMPILE := $(BIN)/uv pip compile --quiet --upgrade --universal --python-version 3.11 --generate-hashes \
	--custom-compile-command "make lock"

# PyO3 looks at the same Python in every build, so that none of them undoes another's.
CARGO := PYO3_PYTHON=$(abspath $(BIN)/python) cargo

.PHONY: cargo
cargo:
	@.ci/check-cargo

$(MADE):
	@python=$$(.ci/find-python $(PYTHON)) && echo "making $(VENV) with $$python" && "$$python" -m venv $(VENV)
	@touch $@

# The kernel is compiled with all optimisation; the Python sources are used where they lie.
$(PACKAGE): $(BUILDERS) pyproject.toml $(RUST_SOURCES) $(if $(KERNEL),,kernel-missing) | cargo
	VIRTUAL_ENV=$(abspath $(VENV)) PIP_CONSTRAINT=$(abspath $(CONSTRAINTS)) \
		$(BIN)/maturin develop --release --locked --extras report,netcdf,studio
	$(BIN)/python -m compileall -q python/truepose
	@touch $@

# zopfli writes what gzip reads, a twentieth smaller than gzip -9: it stands in every page. Neither name nor time is in it.
$(WEB_KERNEL): $(RUST_SOURCES) .cargo/config.toml | $(BUILDERS)
	cargo build --profile web --package truepose-web --target $(WEB_TARGET) --target-dir target --locked
	$(BIN)/python -c 'import sys, zopfli.gzip as of; sys.stdout.buffer.write(of.compress(sys.stdin.buffer.read()))' \
		< target/$(WEB_TARGET)/web/truepose_web.wasm > $@.new
	mv $@.new $@

# What the two kernels are made into packages with.
$(BUILDERS): $(MADE) $(CONSTRAINTS)
	$(BIN)/python -m pip install --quiet --constraint $(CONSTRAINTS) maturin zopfli
	@touch $@

# Has an environment of its own: zig takes 300 MB.
$(RELEASE_TOOLS): $(MADE) release/requirements.txt
	$(BIN)/python -m venv $(dir $@)
	$(dir $@)bin/python -m pip install --quiet --require-hashes --requirement release/requirements.txt
	@touch $@

$(ACTIONLINT):
	GOBIN=$(abspath $(dir $@)) go install github.com/rhysd/actionlint/cmd/actionlint@v1.7.12

# What the lock pins, without its hashes, which pip does not take of constraints.
$(CONSTRAINTS): requirements.lock
	@mkdir -p $(dir $@)
	@sed -e '/^ *--hash=/d' -e 's/ \\$$//' $< > $@

.PHONY: kernel-missing
kernel-missing:

# Has an environment of its own: nothing of it comes into .venv.
$(KLIPPER): $(MADE) tests/klipper/install.py tests/klipper/environment.txt tests/klipper/requirements.txt
	$(BIN)/python tests/klipper/install.py $(dir $@)
	@touch $@

# By uv, which takes seconds where pip takes minutes.
$(TOOLS): $(MADE) requirements.lock
	$(BIN)/python -m pip install --quiet uv==$(UV)
	$(BIN)/uv pip install --quiet --python $(BIN)/python --require-hashes --requirement requirements.lock
	@touch $@
