# make run: the paper's study in small, from data to which controller to use and what of the paper holds. make test: the
# quick tests; make test-slow: the others. CI runs all three. Each installs what it needs into .venv first.

SHELL := /bin/bash
# The first that runs and is new enough; constraints.txt was tried with 3.11.
PYTHON ?= $(shell for each in python3.11 python3 python3.14 python3.13 python3.12; do \
  $$each -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$each && break; done)
# PyTorch without CUDA, which nothing here uses.
TORCH_INDEX ?= https://download.pytorch.org/whl/cpu
STUDY ?= experiments/quick.yaml
CLAIMS ?= experiments/claims.yaml
BIN := .venv/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check

.PHONY: run test lint bench bench-sweeps bench-peers bench-all firmware test-firmware test-faults test-trust \
	test-vision test-identify test-allocation test-slow test-rig fault-table lerobot-reader lost-tendons twins \
	largest-pulls sound-rigs damaged-logs inner-rigs driven-robots test-posterior test-statistics converge worlds docs clean venv \
	mutants coverage installed matrix check-package constraints release servo-faults identified recommended-rigs

run: .venv/run
	@set -eo pipefail; \
	step() { echo; echo "== wristctl $$*"; said=$$($(BIN)/wristctl "$$@"); echo "$$said"; made=$${said##*$$'\n'}; }; \
	step gen-data $(STUDY); data=$$made; \
	step train $(STUDY) --data "$$data"; network=$$made; \
	step tune $(STUDY) --network "$$network"; tuned=$$made; \
	step compare $(STUDY) --network "$$network" --tuned "$$tuned"; \
	step paper audit $(CLAIMS)

test: lint
	$(BIN)/pytest -n auto --maxprocesses 4 -m "not slow"

# Tests of half a second of processor time or more, or with a loop of their own to compile: whole commands, two planes,
# killed processes, the emulated rig.
test-slow: .venv/dev
	$(BIN)/pytest -n auto --maxprocesses 4 -m slow

lint: .venv/dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy --strict wristctl tests docs/*.py
	$(BIN)/mypy --strict benchmarks distribution

bench: .venv/run
	$(BIN)/python benchmarks/rollouts.py
	$(BIN)/python benchmarks/board.py
	$(BIN)/python benchmarks/emulated_bench.py
	$(BIN)/python benchmarks/vision.py

# The documentation as a site, offline, with a gallery of runs made now: build/site/html/index.html.
docs: .venv/docs
	$(BIN)/python docs/build_site.py

# The motor board's image, byte for byte what the package ships (Debian 12: gcc-avr binutils-avr avr-libc).
firmware:
	$(MAKE) -C wristctl/board/firmware check

# The image on simavr and on our own core, thoroughly, and flashed through the stock bootloader
# (Debian 12: also simavr libsimavr-dev libelf-dev pkg-config gcc avrdude arduino-core-avr).
test-firmware: .venv/dev firmware
	$(MAKE) -C tests/firmware
	WRISTCTL_THOROUGH=1 $(BIN)/pytest tests/firmware tests/board tests/bench tests/trial

# Do 95 % intervals of identified parameters hold the truth in 90 to 99 of 100 benches?
test-identify: .venv/dev
	WRISTCTL_THOROUGH=1 $(BIN)/pytest -n auto --maxschedchunk 1 -rP tests/identification

# What identification finds on the emulated rig, whose wrist is known: do its intervals hold the truth? docs/identify.md;
# two minutes a seed, ten with WHICH="--planes 2 --seeds 10"; goes on where it stopped.
identified: .venv/dev
	$(BIN)/python benchmarks/identified_bench.py --out build/identified --seeds 20 $(WHICH)

# Does the command that `recommend` prints keep on the emulated rig what it says? 20 drawn wrists, a quarter of an hour of
# processor time each: docs/hardware/recommended-rigs.md. Goes on where it stopped; WHICH="--count 5", "--page".
recommended-rigs: .venv/dev
	$(BIN)/python -m tests.commands.recommended_rigs $(WHICH)

# Logs damaged as users' logs are: is each damage named, or are the numbers those of the sound log? Sound ones are to stay
# as they are: docs/damaged-logs.md. Keeps what it has tried and goes on from there; WHICH="--count 20 --sound 5"
damaged-logs: .venv/dev
	$(BIN)/python -m tests.identification.damaged_logs $(WHICH)

# Friction inside the wrist and slack, from an open log (--way arcs) and from a loop: found where they are, intervals that
# hold? WHICH="--way loop --count 40"
inner-rigs: .venv/dev
	$(BIN)/python -m tests.identification.inner_rigs $(WHICH)

# Robots of three tendons that are driven by motor current, from their logs: do intervals of ratios, directions and delays
# hold, is a circle predicted? Half an hour; goes on where it stopped. WHICH="--count 5"
driven-robots: .venv/dev
	$(BIN)/python -m tests.identification.driven_robots $(WHICH)

# Is a law that is said to be best with probability p on an identified wrist the best there? WHICH="--count 100"
test-posterior: .venv/dev
	$(BIN)/python -m tests.identification.posterior_rigs $(WHICH)

# Do 95 % intervals of a comparison hold the truth as often, and groups of ties all that are alike?
test-statistics: .venv/dev
	WRISTCTL_THOROUGH=1 $(BIN)/pytest -s tests/comparison tests/tuning

# Pulls of three to six tendons in two planes against a linear program, at 10,000 poses each.
test-allocation: .venv/dev
	WRISTCTL_THOROUGH=1 $(BIN)/pytest -s tests/wrist/test_allocation.py

# Cameras, markers and calibration with many more frames, and their runs repeated.
test-vision: .venv/dev
	WRISTCTL_THOROUGH=1 $(BIN)/pytest tests/vision tests/cli/test_vision_commands.py

# Faults of motors, tendons, camera, cable, host and board at every phase, one by one and in pairs, and sound rigs;
# hw-run stopped, killed and interrupted.
test-faults: .venv/dev
	WRISTCTL_THOROUGH=1 $(BIN)/pytest -s tests/trial/test_fault_table.py
	WRISTCTL_THOROUGH=1 $(BIN)/pytest -s tests/cli/test_hw_run_stops.py tests/cli/test_hw_run_killed.py

# Each fault of each emulated servo: docs/servos.md. Keeps what it has tried in build/servo-faults.
servo-faults: .venv/dev
	$(BIN)/python -m tests.servos.fault_table $(WHICH)

# Faults that creep, cancel each other or come again: docs/hardware/fault-table.md. Keeps what it has tried in
# build/fault-table and goes on from there; WHICH="--phase moving --count 10" tries some.
fault-table: .venv/dev
	$(BIN)/python -m tests.trial.further_faults $(WHICH)

# Tendons, motors and drives that fail in a trial in two planes: docs/hardware/lost-tendons.md. Goes on where it stopped.
lost-tendons: .venv/dev
	$(BIN)/python -m tests.trial.lost_tendons $(WHICH)

# Rigs and gains drawn at random: does the simulation beside a trial swing where the rig does? docs/hardware/twins.md,
# an hour; goes on where it stopped.
twins: .venv/dev
	$(BIN)/python -m tests.trial.twins $(WHICH)

# One motor that fails, motors exchanged, a hand or an edge that holds the wrist, at either current, and a load that the
# hand takes up: how hard does a tendon pull? docs/hardware/largest-pulls.md; goes on where it stopped.
# WHICH="--motion ulnar --current '2.4 A'", "--page" of what was tried.
largest-pulls: .venv/dev
	$(BIN)/python -m tests.trial.largest_pulls $(WHICH)

# 100 sound rigs drawn with wrist, gains, motion, pose, light, link, friction and declared load: which are stopped all the
# same? docs/hardware/sound-rigs.md; goes on where it stopped. WHICH="--first 40 --count 20"
sound-rigs: .venv/dev
	$(BIN)/python -m tests.trial.sound_rigs $(WHICH)

# The real path, serial port and camera device, against the emulated rig in real time: first-power-up.md walked, a slow
# link and camera found out, hostile bytes. Alone: beside other work they end as skipped.
test-rig: .venv/dev
	WRISTCTL_RIG=1 $(BIN)/pytest -s -rs $(AGAIN) tests/rig

# LeRobot's own reader opens what `runs export --to lerobot` writes. It needs Python 3.12 or newer and an environment of its
# own, build/lerobot: 6 GB where PyTorch comes with CUDA. LEROBOT_PYTHON=/path/to/python3.12 names one.
LEROBOT_PYTHON ?= $(shell for each in python3.12 python3.13 python3.14 python3; do \
  $$each -c 'import sys; sys.exit(sys.version_info < (3, 12))' 2>/dev/null && echo $$each && break; done)
lerobot-reader: .venv/dev
	$(if $(LEROBOT_PYTHON),,$(error LeRobot needs Python 3.12 or newer: make lerobot-reader LEROBOT_PYTHON=/path/to/python3))
	@test -x build/lerobot/bin/pip || $(LEROBOT_PYTHON) -m venv build/lerobot
	build/lerobot/bin/pip install --quiet 'lerobot[dataset]>=0.6,<0.7'
	WRISTCTL_LEROBOT=$(CURDIR)/build/lerobot/bin/python $(BIN)/pytest tests/commands/test_export_lerobot.py

# The built wheel in an environment of its own and an empty folder: `make installed WITH=python3.13`, `OLDEST=--lowest`.
installed: .venv/dev
	$(BIN)/python benchmarks/installed.py $(WITH) $(OLDEST)

# Source archive and wheel in dist/, and the package's own descriptions, workflows and settings, checked by others' tools.
check-package: .venv/dev build/tools/ready
	$(BIN)/python distribution/release.py --build
	build/tools/bin/twine check --strict dist/wristctl-*
	build/tools/bin/check-wheel-contents dist
	build/tools/bin/cffconvert --validate
	build/tools/bin/zizmor --offline .github
	build/tools/bin/sp-repo-review .

build/tools/ready: distribution/tools.txt
	$(PYTHON) -m venv build/tools
	build/tools/bin/pip install --quiet --disable-pip-version-check -r distribution/tools.txt
	@touch $@

# The newest versions that fit together, written to constraints.txt (needs uv); then make test test-slow.
constraints:
	$(PYTHON) distribution/constraints.py

# A release, but for what only a person does, which it says at its end: make release VERSION=0.2.0
release: .venv/dev
	$(BIN)/python distribution/release.py $(VERSION)

# Every Python that is here, one after the other: the wheel, commands and tests, some minutes each.
matrix: .venv/dev
	$(BIN)/python benchmarks/matrix.py $(WHICH)

# A sweep over each kind of setting beside a batch of as many gains, 6 min.
bench-sweeps: .venv/run
	$(BIN)/python benchmarks/sweeps.py

# Drawn settings and the shipped comparisons at shorter integration steps: docs/convergence.md, some ten minutes; fails
# where numbers change that are not marked.
converge: .venv/run
	$(BIN)/python docs/convergence.py

bench-peers: .venv/run
	$(BIN)/python benchmarks/peers/run.py --out results/$$(date -u +%Y%m%dT%H%M%SZ)-peers

# Everything that docs/benchmarks.md says, measured anew, and the page.
bench-all: .venv/run
	$(BIN)/python benchmarks/all.py

# How accurate tendon loops are, what friction does to each law, where presets come to rest, and how fast tensions cross
# their range: docs/accuracy.md, docs/friction.md, docs/margins.md, docs/chattering.md; fails where a preset swings, or
# where what is said to chatter is not far from all else.
worlds: .venv/run
	-$(BIN)/python docs/accuracy.py
	$(BIN)/python docs/friction.py
	$(BIN)/python docs/margins.py
	$(BIN)/python docs/chattering.py

# Every command killed, refused and interrupted at all points, crowds of processes, 20,000 runs, a run of every kind
# repeated, other surroundings and processors.
test-trust: .venv/dev
	WRISTCTL_THOROUGH=1 $(BIN)/pytest -s tests/faults tests/cli/test_kill.py tests/cli/test_crowd.py \
	  tests/cli/test_environments.py tests/cli/test_closed_pipe.py tests/cli/test_replay.py tests/records/test_query.py tests/lanes/test_processors.py

# Small wrong changes to a copy of the package: does a test notice each? The listed ones, or `make mutants SEED=7`.
mutants: .venv/dev
	$(BIN)/python -m tests.mutants.run $(if $(SEED),--seed $(SEED))

coverage: .venv/dev
	$(BIN)/pytest -n auto --maxprocesses 4 --cov=wristctl --cov-report=term --cov-report=html:build/coverage

venv: .venv/dev

# PyTorch's own index is asked first, but not for long: what pip finds without it brings CUDA on Linux x86-64.
.venv/torch: constraints.txt
	$(if $(PYTHON),,$(error Python 3.11 or newer is needed, and none was found: make PYTHON=/path/to/python3 names one))
	@test -x $(BIN)/pip || $(PYTHON) -m venv .venv
	@echo "Downloads into .venv what is not there yet: PyTorch without CUDA (190 MB), then other packages (330 MB at most)"
	@trap 'exit 130' INT; torch=$$(grep '^torch==' constraints.txt); \
	$(PIP) install --no-deps --timeout 5 --retries 0 --index-url $(TORCH_INDEX) $$torch || { \
	  echo "No $$torch from $(TORCH_INDEX): pip's own index is asked. On Linux x86-64 that may bring CUDA, 2.7 GB"; \
	  $(PIP) install -c constraints.txt $$torch; }
	@touch $@

# What an extra of wristctl needs, and so many downloads.
define install
@echo "Downloads into .venv what is not there yet: packages that wristctl$(1) needs ($(2))"
@$(PIP) install --quiet -c constraints.txt -e '.$(1)'
endef

.venv/run: pyproject.toml constraints.txt | .venv/torch
	$(call install,,230 MB)
	@touch $@

.venv/docs: pyproject.toml constraints.txt | .venv/torch
	$(call install,[docs],250 MB)
	@touch $@ .venv/run

.venv/dev: pyproject.toml constraints.txt | .venv/torch
	$(call install,[dev],330 MB)
	@touch $@ .venv/run .venv/docs

clean:
	rm -rf build .venv .mypy_cache .pytest_cache .ruff_cache .hypothesis dist
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
