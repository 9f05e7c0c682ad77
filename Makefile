# make demo        set up, and place sensors at the shipped junction
# make site        build a site from an OpenStreetMap extract, with sensors and a report (installs SUMO: 230 MB)
# make network     spread one budget over the junctions of an invented town (installs SUMO)
# make test        set up, and run the quick tests
# make test-short  run those that depend on Blender's and Python's version
# make test-slow   install PyTorch and SUMO, and run the slow tests, those of the detector and of the studies
# make test-long   run searches with more random cases than CI has time for (an hour)
# make lint        set up, and check style and types
# make scenes      rebuild the shipped scenes from their sources
# make detection   install PyTorch, for the detector
# make sumo        install Eclipse SUMO, for extracts and traffic (230 MB)
# make study       redo the study on the shipped junction: coverage and detection (make -j2 study: ten minutes)
# make detector    train a detector as the shipped one, at 64 random sites (needs a GPU)
# make stability   drive every method to where it fails, and write docs/stability.md (an hour)
# make traffic     simulate the shipped traffic again (installs Eclipse SUMO in the environment: 230 MB)
# make benchmark   measure speed again, and write docs/benchmark.md (15 minutes)
# make extension   build the Blender extension in dist/
# make lock        write wheels.lock again, the digests of all pinned packages, after a pin has changed
# make clean       remove what was built; make distclean removes the environment and the wheels as well
#
# Another Python: make PYTHON=python3.13 VENV=.venv313 test

PYTHON ?= python3
VENV ?= .venv
PLATFORMS ?= linux-x64
PY := "$(VENV)/bin/python"
SPREAD := -n auto --maxprocesses 4
DEMO := scenes/junction.blend --sensor type1 type2 type3 -o out/junction

.DEFAULT_GOAL := help
.PHONY: help environment demo site network test test-short test-slow test-long lint scenes sumo traffic detection study coverage-study detection-study detector stability benchmark extension lock clean distclean

help:
	@sed -n '/^#/!q; s/^#\( \|$$\)//p' Makefile

environment:
	@$(PYTHON) -m headless.set_up "$(VENV)"

demo: environment
	$(PY) -m headless.place $(DEMO)
	@echo "pictures: out/junction/"; ls out/junction/*.png

site: sumo
	$(PY) -m headless.build_scene scenes/harbour.osm --junction "Harbour Road" "Rope Lane" -o out/harbour.blend
	$(PY) -m headless.place out/harbour.blend --sensor type2 --count 4 -o out/harbour
	$(PY) -m headless.report out/harbour
	@echo "pictures and report: out/harbour/"; ls out/harbour/*.png out/harbour/report.*

network: sumo
	$(PY) -m headless.network scenes/town.osm --junctions all --budget 150_000 --gap 0.05 -o out/town
	@echo "report: out/town/report.html, report.pdf"

test: environment
	$(PY) -m pytest $(SPREAD) --ignore tests/studies --ignore tests/detection -m "not slow and not long"

test-short: environment
	$(PY) -m pytest $(SPREAD) -m "not slow and not long" tests/scene tests/package tests/headless/test_place.py

# What `make test` leaves out: slow tests, and those that need PyTorch.
test-slow: detection sumo
	@$(PYTHON) -m headless.set_up "$(VENV)" second-opinion
	$(PY) -m pytest $(SPREAD) -m "slow and not long" --ignore tests/studies --ignore tests/detection
	$(PY) -m pytest $(SPREAD) -m "not long" tests/studies tests/detection tests/package/test_examples.py \
	  tests/core/storage/test_source_digest.py tests/headless/test_output_folders.py

# Searches with more random cases than CI has time for; of all properties, hypothesis's hundred cases.
test-long: environment
	$(PY) -m pytest $(SPREAD) -m "long or hypothesis"

lint: environment
	$(PY) -m ruff check
	$(PY) -m ruff format --check
	$(PY) -m mypy

scenes: environment
	$(PY) -m headless.build_scene scenes/junction.toml -o scenes/junction.blend
	$(PY) -m headless.build_scene scenes/corridor.toml -o scenes/corridor.blend

sumo: environment
	@$(PYTHON) -m headless.set_up "$(VENV)" traffic

# Runs of one scene differ by their seed, and by the second of the signals' cycle of 60 s at which they begin; dense ones
# have twice the vehicles. They are many and short, as whole runs alone are independent of each other.
traffic: sumo
	for seed in 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16; do \
	  $(PY) -m headless.traffic scenes/junction.blend --simulate scenes/junction.xodr --flow 500 --pedestrians 120 \
	    --duration 40 --warm-up $$((120 + 37 * seed % 60)) --seed $$seed -o scenes/junction_traffic/run-$$seed.npz || exit; done
	for seed in 21 22 23 24; do \
	  $(PY) -m headless.traffic scenes/junction.blend --simulate scenes/junction.xodr --flow 1100 --pedestrians 120 \
	    --duration 40 --warm-up $$((120 + 37 * seed % 60)) --seed $$seed -o scenes/junction_traffic_dense/run-$$seed.npz || exit; done
	for seed in 7 8 9 10; do \
	  $(PY) -m headless.traffic scenes/corridor.blend --simulate scenes/corridor.xodr --flow 450 --pedestrians 100 \
	    --duration 40 --warm-up $$((120 + 37 * seed % 60)) --seed $$seed -o scenes/corridor_traffic/run-$$seed.npz || exit; done

# PyTorch: 200 MB for the CPU alone, several GB where pip finds builds for graphics cards first.
detection: environment
	@$(PYTHON) -m headless.set_up "$(VENV)" detection

# Two commands, which `make -j2 study` runs side by side.
study: coverage-study detection-study

coverage-study: detection
	$(PY) -m headless study coverage scenes/junction.blend -o out/study/coverage

detection-study: detection
	$(PY) -m headless study detection scenes/junction.blend -o out/study/detection

detector: detection sumo
	$(PY) -m headless study random-sites -o out/sites --sites 64 --seed 1
	$(PY) -m headless study site-training out/sites/site-*/site.blend --placements 2 --seed 7 \
	  --steps 13381 --batch 64 --patience 50 --device cuda -o out/detector
	cp out/detector/detector.pt headless/detection/shipped_detector.pt
	rm -f headless/detection/shipped_detector.confidence.json  # of the earlier one: fit it again, docs/detection.md

stability: environment
	$(PY) -m headless study stability scenes/junction.blend -o docs

benchmark: environment
	$(PY) -m headless study benchmark scenes/junction.blend -o docs

extension: environment
	$(PY) -m headless.build_extension --platforms $(PLATFORMS)

# The environment as it is: one of the new pins needs the new digests.
lock:
	$(PY) -m headless.lock_wheels

clean:
	rm -rf build dist out .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -not -path './.venv*' -prune -exec rm -rf {} +

distclean: clean
	rm -rf "$(VENV)" wheels
