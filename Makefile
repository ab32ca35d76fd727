# Everything runs in .venv, which `make` builds itself. Debian: apt install python3 python3-venv make
PYTHON ?= python3
BIN = .venv/bin
export NUMBA_CACHE_DIR ?= $(CURDIR)/.venv/numba
export PYTHONDONTWRITEBYTECODE = # the tests start many processes: none translates what another did

.PHONY: help demo test check wheel site bench commission foreign blind fusion integrity thesis clean

help: ## this list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/' | expand -t 16

.venv/ready: pyproject.toml requirements.lock
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check --upgrade pip
	$(BIN)/pip install --quiet --disable-pip-version-check -c requirements.lock -e '.[dev]'
	touch $@

.venv/compiled: .venv/ready $(shell find thrustd -name '*.py')
	$(BIN)/python -m tests.compiled
	touch $@

demo: .venv/ready ## replay a reference flight: numbers, estimate log, picture in out/
	@mkdir -p out
	$(BIN)/thrustd replay replay_logs/throttle-steps.mcap -o out/demo.mcap --picture out/demo.png

test: .venv/compiled ## everything that proves the project
	$(BIN)/python -m pytest -n 2 --dist worksteal $(PYTEST)

check: .venv/ready ## format, lint, types; Python and JavaScript
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/biome ci --colors=off

wheel: .venv/ready ## out/thrustd-VERSION-py3-none-any.whl
	$(BIN)/pip wheel --quiet --disable-pip-version-check --no-deps -w out .

site: .venv/ready ## the pages as a site in out/site; a broken link fails
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet

bench: .venv/ready ## speed and memory, measured here
	$(BIN)/python -m benchmarks

fusion: .venv/ready ## error and band of healthy aircraft that nothing was chosen on: recorded flights flown by the twin
	$(BIN)/python -m benchmarks.fusion_ensemble

integrity: .venv/ready ## faults at every moment, three aircraft, hostile aircraft, hours of healthy ones: is it ever confidently wrong?
	$(BIN)/python -m benchmarks.healthy_hours --minutes 30; $(BIN)/python -m benchmarks.integrity

commission: .venv/ready ## a stranger's aircraft with a hostile installation: from bench records to a scored flight
	$(BIN)/python -m benchmarks.commission

foreign: .venv/ready ## the loop on measured rubber, dampers and drives and on mounts of others, where their data lie beside the project
	$(BIN)/python -m benchmarks.foreign

blind: .venv/ready ## hide effects, find them, count: confusion matrix and fall of the error
	$(BIN)/python -m benchmarks.blind

thesis: .venv/ready ## the thesis' table beside ours from the twin's bench, pictures in out/
	@mkdir -p out
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks.thesis_table --pictures out

clean: ## remove what make made
	rm -rf .venv out
