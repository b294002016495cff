# Every target sets itself up: `make demo` in a fresh clone needs only make and Python 3.11 or newer.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
STAMP  := $(VENV)/installed

.DEFAULT_GOAL := help
.PHONY: help compiled plain test-compiled demo house readme pictures docs setup test check browser animation format bench cost bench-replay bench-sweep networks small-networks city throughput soak mutants standstills car-following unseen long-vehicles buses covering standing watched day scale attached ordinary circulator any-traffic lights mixed-traffic real-networks streams scenarios recount fuzz proofs wheel public-inputs sumo-versions vehicles-alone vehicles-roads vehicles-costs vehicles-processes lock clean

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-15s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

$(STAMP): requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "loopgate needs Python 3.11 or newer; $(PYTHON) is " + sys.version.split()[0] + ". Try: make PYTHON=python3.12")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --quiet --disable-pip-version-check --no-compile --require-hashes -r requirements.lock
	@# On all processors, and without the tests of others: pip compiles on one.
	@$(BIN)/python -W ignore -m compileall -qq -j 0 -x /tests/ $(VENV)/lib || true
	$(BIN)/python -m pip install --quiet --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $@

demo: $(STAMP) ## one hour in south-east Berlin, SUMO beside loopgate; and the method of the paper
	$(BIN)/python analysis/demo.py

docs: $(STAMP) ## build the documentation as a site (site/index.html); a broken link fails
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	@echo "site/index.html: $$(find site -name "*.html" | wc -l) pages"

readme: $(STAMP) ## make the pictures of the README and docs/ and the README's first table anew
	$(BIN)/python analysis/readme.py

pictures: $(STAMP) ## draw the pictures of the concepts and of the gallery anew (needs Chromium)
	$(BIN)/python analysis/pictures.py
	$(BIN)/python analysis/gallery.py

setup: $(STAMP) ## make .venv with everything that requirements.lock names

compiled: $(STAMP) ## compile the ledger in place (needs a C compiler); after a change do it again
	$(BIN)/python analysis/compiled_wheel.py

plain: $(STAMP) ## remove what `make compiled` made
	$(BIN)/python analysis/compiled_wheel.py --remove

test-compiled: $(STAMP) ## run the tests with simulations once more, with the ledger compiled in a copy
	$(BIN)/python analysis/compiled_wheel.py --copy out/compiled
	PYTHONPATH=out/compiled $(BIN)/python -m pytest -n auto --dist worksteal -m "sumo and not slow" tests/sumo

test: $(STAMP) ## run all tests but the slow ones and those in a browser
	$(BIN)/python tests/support/compiling.py
	$(BIN)/python -m pytest -n auto --dist worksteal -m "not slow" --ignore=tests/browser

check: $(STAMP) ## lint, format, types, import layers
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo
	$(BIN)/python -m pip check

browser: $(STAMP) ## test the pages in a real browser, Chromium without a window
	@$(BIN)/python analysis/chromium.py
	$(BIN)/python -m pytest tests/browser -n auto --dist loadfile

animation: $(STAMP) ## make the README's animation anew (needs Chromium)
	$(BIN)/python analysis/animation.py

format: $(STAMP) ## put the code into the house format
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

bench: $(STAMP) ## measure: gated runs against plain SUMO, decisions of algorithm2 and certified, exploration
	$(BIN)/python analysis/bench_run.py
	$(BIN)/python analysis/bench_theory.py
	$(BIN)/python analysis/bench_certified.py

cost: $(STAMP) ## measure: what the gate costs on top of SUMO's own steps, plain and compiled, in pairs
	$(BIN)/python analysis/cost.py

bench-replay: $(STAMP) ## measure: frames per second of replays, 400 and 2,000 vehicles (needs Chromium)
	$(BIN)/python analysis/bench_replay.py

recount: $(STAMP) ## count the figures of six runs again from SUMO's own files: all agree
	$(BIN)/python analysis/recount.py

networks: $(STAMP) ## rebuild networks/*.net.xml and show what changed
	$(BIN)/python networks/build.py

house: $(STAMP) ## measure the house by its ways: files executed from input to effect, circles, lines by room
	$(BIN)/python analysis/house.py

mutants: $(STAMP) ## break the ledger and the chain rule in 300 small ways: what no test notices; hours, goes on where it stopped
	nice $(BIN)/python analysis/mutants.py

bench-sweep: $(STAMP) ## measure: sweeps in one process and in one per processor
	$(BIN)/python analysis/bench_sweep.py

small-networks: $(STAMP) ## deadlocks and collisions on the small networks, gate by gate, 20 seeds
	$(BIN)/python analysis/sweep_table.py analysis/small_networks.toml

city: $(STAMP) ## packaged cities under algorithm2, loops of bounded and unbounded sharing
	$(BIN)/python analysis/sweep_table.py analysis/city.toml

throughput: $(STAMP) ## vehicle-km in the hour, SUMO's own rules beside the gates, five seeds: docs/studies/throughput.md
	$(BIN)/python analysis/throughput.py --seeds 5 --write
	$(BIN)/python analysis/throughput_city.py --seeds 5 --write
	$(BIN)/python analysis/limit.py --seeds 5 --step 1 --write
	$(BIN)/python analysis/limit.py --seeds 5 --step 0.5 --write
	$(BIN)/python analysis/throughput_lights.py --seeds 5 --duration 900 --write
	$(BIN)/python analysis/alone.py --seeds 5 --write

soak: $(STAMP) ## ten simulated hours per network and gate; all tests, slow ones too, with many more examples
	$(BIN)/loopgate sweep analysis/soak.toml -o out/soak
	$(BIN)/loopgate report out/soak -o out/soak/report.html
	$(BIN)/python -m pytest -n auto --hypothesis-profile=soak

covering: $(STAMP) ## how near covering loops come to what is possible
	$(BIN)/python analysis/covering.py

standing: $(STAMP) ## one vehicle that stands for 10 to 60 minutes: how far everybody else drives: docs/standing.md
	$(BIN)/python analysis/standing.py --rules contained open --write

watched: $(STAMP) ## how often streets are seen: SUMO and the gate, loops by design and by chance, spacing: docs/studies/covering.md
	$(BIN)/python analysis/watched.py --seeds 5 --write

standstills: $(STAMP) ## 200 made networks that lock up and 100 gated runs past closures: what was told, beside SUMO's positions afterwards
	$(BIN)/python analysis/standstills.py --seeds 200 --gated 100

car-following: $(STAMP) ## every car-following model of SUMO under the gate, soft and hard brakes, slow and fast roads: 800 of 3,264 runs
	$(BIN)/python analysis/car_following.py

unseen: $(STAMP) ## 200 made networks of every kind, with positions: what is not as it should be
	$(BIN)/python analysis/unseen.py --made 200 --out out/unseen/made

long-vehicles: $(STAMP) ## buses and trailers among cars, with positions: whether bodies overlap
	$(BIN)/python analysis/long_vehicles.py

buses: $(STAMP) ## what cars lose by buses of 12 and 18 m among them, beside SUMO's rules
	$(BIN)/python analysis/buses.py

day: $(STAMP) ## 24 simulated hours in south-east Berlin, 300 vehicles: anything lost, memory by the hour
	$(BIN)/python analysis/day.py

scale: $(STAMP) ## thousands of vehicles at a time on a grid of 40 x 40: what the gate takes on top of SUMO, memory
	$(BIN)/python analysis/scale.py

proofs: ## check the proofs of docs/proofs by machine (needs Rocq, called coqc)
	@command -v coqc > /dev/null || { echo "make proofs needs Rocq 8.16 or newer (coqc): apt-get install coq, or opam install coq"; exit 2; }
	@mkdir -p out/proofs && cp docs/proofs/*.v out/proofs
	@cd out/proofs && begin=$$(date +%s) && for name in Model Chain Push Crowd Service Way Ends Everyone Change Instance Homes Posts Books Probes Going; do \
		echo "$$name.v, $$(wc -l < $$name.v) lines; its theorems assume:" && coqc $$name.v || exit 1; done && \
		echo "$$(cat *.v | wc -l) lines checked in $$(($$(date +%s) - begin)) s"

vehicles-alone: $(STAMP) ## the chain rule by messages: 5,000 random systems beside the central rule, and every order on small ones
	$(BIN)/python analysis/vehicles_alone.py
	$(BIN)/python analysis/vehicles_every_order.py

vehicles-roads: $(STAMP) ## vehicles that decide by messages on the road: kilometres beside the central gate, messages, what loss, delay and range cost
	$(BIN)/python analysis/vehicles_roads.py

vehicles-costs: $(STAMP) ## draw what range, loss and delay cost vehicles that decide by messages, from analysis/tables/vehicles-costs.md
	$(BIN)/python analysis/vehicles_costs.py

vehicles-processes: $(STAMP) ## 50 vehicles whose controllers are processes, one hour: ten are killed, the network is cut for a minute
	$(BIN)/python analysis/vehicles_processes.py

attached: $(STAMP) ## vehicles that join and leave among ordinary traffic, whose owner interferes: two hours, five seeds
	$(BIN)/python analysis/attached.py

ordinary: $(STAMP) ## patrol cars among ordinary trips, SUMO beside the gate: collisions and waits, two hours, five seeds
	$(BIN)/python analysis/ordinary.py

circulator: $(STAMP) ## three bus lines by timetable among patrol cars and trips: stops, punctuality, locks
	$(BIN)/python analysis/circulator.py

any-traffic: $(STAMP) ## trips in a grid and a district, from light to far beyond what they can take: drained by when, SUMO beside
	$(BIN)/python analysis/any_traffic.py --drawn grid drt

LIGHTS := "gate" "gate, lights obeyed" "SUMO, its lights" "SUMO, actuated" "SUMO, max-pressure"
SEEDS ?= 5
DEMANDS ?= --made avenues web "old town" --times 0.5 1 1.5

lights: $(STAMP) ## an hour of trips among lights, the gate beside SUMO: DEMANDS="--demand NET ROUTES BEGIN ..." for yours
	$(BIN)/python analysis/any_traffic.py $(DEMANDS) --seeds $(SEEDS) --most-hours 1 --rules $(LIGHTS) --out out/lights

mixed-traffic: $(STAMP) ## a public benchmark of junctions, SUMO beside the gate: BENCHMARK=folder of a checked-out copy
	$(BIN)/python analysis/mixed_traffic.py $(BENCHMARK)

real-networks: $(STAMP) ## real networks with their own demand, beside three of SUMO's lights: NETWORKS=folder of checked-out copies
	$(BIN)/python analysis/real_networks.py $(NETWORKS)

streams: $(STAMP) ## roundabouts, ramps, lane drops and weaving beside SUMO's rules, at three demands
	$(BIN)/python analysis/streams.py

scenarios: $(STAMP) ## ten scenarios of SUMO's own generators, under its rules and under the gate: nothing dropped
	$(BIN)/python analysis/scenarios.py

wheel: $(STAMP) ## build compiled wheels, try them in empty environments: each Python there is, newest and oldest dependencies
	$(BIN)/python analysis/wheel.py

public-inputs: $(STAMP) ## drive public scenarios under SUMO's rules and under the gate: make public-inputs INPUTS=FOLDER
	$(BIN)/python analysis/public_inputs.py $(INPUTS)

sumo-versions: $(STAMP) ## attach the gate to installed SUMO from 1.20 to 1.28 through traci (downloads each)
	$(BIN)/python analysis/sumo_versions.py

lock: ## renew requirements.lock (needs uv)
	uv pip compile pyproject.toml --extra dev --universal --generate-hashes --no-header --no-annotate --quiet -o requirements.lock

fuzz: $(STAMP) ## spoil 20,000 valid inputs and 500 command lines: each is read, or refused in one line
	$(BIN)/python analysis/fuzz.py

clean: ## remove what the other targets made
	rm -rf $(VENV) out build dist .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis
