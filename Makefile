# `make demo` and `make test` need Python 3.11+ and the package index, nothing else: each makes
# its own virtual environment. The FMUs are compiled during installation by ziglang, a compiler
# from the package index.
PYTHON ?= python3
.DEFAULT_GOAL := demo

# Images of containers often forbid Python to keep what it has compiled. Each of our many processes
# would then compile all modules anew: a run of five takes twice as long to begin and to end.
unexport PYTHONDONTWRITEBYTECODE

# every environment .venv-NAME: this package, editable, with the extras EXTRAS_NAME
EXTRAS_demo =
EXTRAS_test = dev
EXTRAS_bench = bench,peers
EXTRAS_docs = docs
EXTRAS_net = net
EXTRAS_paper = experiment,cpm
EXTRAS_apmm = experiment,verify
EXTRAS_costs = experiment,cpm,verify
EXTRAS_release = release
EXTRAS_audit = audit
EXTRAS_train = train
EXTRAS_mutation = mutation

# what a new installation is needed for: dependencies, entry points, and what the FMUs are made of
INSTALLED_FROM := pyproject.toml hatch_build.py $(shell find fmus -name '*.[ch]' -o -name 'interface.py' -o -name 'undriven.py' -o -name 'caution.py' -o -path 'fmus/native/*.py' -o -path 'fmus/messages/records.py' -o -path 'fmus/messages/bodies.py') orchestrator/plan/engine.c orchestrator/recording/planes.c adapters/sumo/headless/absent.c

.PHONY: help demo test test-slow docs bench paper paper-relay paper-collision paper-point-transformer paper-generalisation paper-lasting paper-readings paper-sensitivity train general verify verify-perception net release clean apmm verify-faults verify-reliability verify-mutation paper-oracle costs figures release-again audit dependencies

help:  ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  %-18s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

.venv-%/installed: $(INSTALLED_FROM)
	$(PYTHON) -c 'import sys; sys.exit("Python 3.11 or newer is needed; set PYTHON=python3.x") if sys.version_info < (3, 11) else None'
	$(PYTHON) -m venv .venv-$*
	.venv-$*/bin/python -m pip install --quiet --disable-pip-version-check --no-compile --editable '.$(if $(EXTRAS_$*),[$(EXTRAS_$*)])'
	touch $@

demo: .venv-demo/installed  ## run the red-light scenario, closed loop, from nothing
	.venv-demo/bin/nlosim run red_light

PYTEST = .venv-test/bin/python -m pytest -n logical --dist loadfile --no-loadscope-reorder

test: .venv-test/installed  ## what CI checks, except the tests that take long
	.venv-test/bin/ruff check .
	.venv-test/bin/ruff format --check .
	.venv-test/bin/lint-imports
	@echo 'mypy, beside the rest'; .venv-test/bin/mypy & types=$$!; \
	NO_MKDOCS_2_WARNING=1 .venv-test/bin/mkdocs --quiet build --strict \
	  && $(PYTEST) -m 'not slow'; \
	others=$$?; wait $$types && exit $$others
	@echo 'the tests that take more than three seconds each: make test-slow'

test-slow: .venv-test/installed  ## the tests that take long, whole runs and sanitizers; CI runs them, too
	$(PYTEST) -m slow

docs: .venv-docs/installed  ## the manual as a site, in build/site; it can be opened from disk
	NO_MKDOCS_2_WARNING=1 .venv-docs/bin/mkdocs --quiet build --strict
	@echo "open build/site/index.html"

release: .venv-release/installed  ## make release VERSION=1.2.3: build, try, commit, tag; DRY_RUN=1 only checks, PUBLISH=1 uploads
	.venv-release/bin/python release.py $(or $(VERSION),$(error which version? make release VERSION=1.2.3)) $(if $(DRY_RUN),--dry-run) $(if $(PUBLISH),--publish)

release-again: .venv-release/installed  ## make release-again VERSION=1.2.3: build its tag once more, and compare the bytes
	.venv-release/bin/python release.py $(or $(VERSION),$(error which version? make release-again VERSION=1.2.3)) --again

audit: .venv-audit/installed .venv-demo/installed  ## known vulnerabilities of what is installed; it says so if nobody can be asked
	.venv-audit/bin/python audit.py $$(.venv-demo/bin/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')

dependencies: .venv-test/installed  ## docs/dependencies.md: what is installed, with licences and sizes
	.venv-test/bin/python dependencies.py docs/dependencies.md

bench: .venv-bench/installed  ## measure, and make docs/benchmarks.md; keep the machine quiet
	mkdir -p docs/results
	.venv-bench/bin/nlosim bench channel --json > docs/results/bench-channel.json
	.venv-bench/bin/nlosim bench lidar --json > docs/results/bench-lidar.json
	OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 .venv-bench/bin/nlosim bench policy --json > docs/results/bench-policy.json
	OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 .venv-bench/bin/nlosim bench egos --json > docs/results/bench-egos.json
	OPENBLAS_NUM_THREADS=1 .venv-bench/bin/nlosim bench importer --json > docs/results/bench-importer.json
	.venv-bench/bin/nlosim bench scene --json > docs/results/bench-scene.json
	.venv-bench/bin/nlosim bench page --json > docs/results/bench-page.json
	.venv-bench/bin/nlosim bench distributed --repeat 3 --json > docs/results/bench-distributed.json
	.venv-bench/bin/python -m benchmarks.page docs/benchmarks.md docs/results/bench-*.json

# SEEDS=1..5 is a quick look in directories of its own, without docs; without SEEDS it is the study.
# Both go on where they were interrupted; remove the directories to begin anew.
SUFFIX = $(if $(SEEDS),-$(SEEDS))
RELAY_PAGE = .venv-paper/bin/python -m studies.relay docs/relay-study.md docs/results docs/results/relay-analysis.md
PAPER = runs/paper_relay$(SUFFIX)
COLLISION = collision_policies collision_constant_per collision_speed collision_memory collision_memory_direct collision_relay collision_radio collision_load
LASTING = $(foreach scene,turning beside opposing,lasting_$(scene)_relay lasting_$(scene)_policies) $(addprefix lasting_turning_,constant memory held) lasting_turning_ahead lasting_opposing_ahead
READINGS = relay_readings relay_scenes relay_ahead relay_map_budget relay_map_load
GENERALISATION = $(addprefix generalisation_,red_light left_turn overtaking pedestrian platoon $(foreach end,general held compression alone early elsewhere elsewhere_blind point,$(addsuffix _$(end),red_light left_turn pedestrian platoon)) $(foreach end,seeds many seeds_16,$(addsuffix _$(end),red_light left_turn pedestrian)) red_light_one_side overtaking_overtaker overtaking_overtaker_blind)
ORACLE = relay_fair_oracle relay_trajectories

# $(call run_study,FOLDER,NAME): one experiment, into runs/NAME; the point transformer takes PyTorch
define run_study
$(if $(filter %_point,$(2)),.venv-train,.venv-paper)/bin/nlosim experiment studies/$(1)/experiments/$(2).yaml --out runs/$(2)$(SUFFIX) $(if $(SEEDS),--seeds $(SEEDS)) $(if $(wildcard runs/$(2)$(SUFFIX)/experiment.json),--resume)

endef

# $(call study,FOLDER,NAMES,MODULE,DIR,PAGE): experiments, and of their reports the page docs/PAGE.md, or a quick look in runs/DIR
LOOK = runs/$(4)$(SUFFIX)
define study
$(foreach name,$(2),$(call run_study,$(1),$(name)))
mkdir -p $(if $(SEEDS),$(LOOK),docs/results)
cp $(foreach name,$(2),runs/$(name)$(SUFFIX)/report/*) $(if $(SEEDS),$(LOOK),docs/results)/
.venv-paper/bin/python -m $(3) $(if $(SEEDS),$(LOOK)/$(5).md $(LOOK),docs/$(5).md docs/results docs/results/$(4)-analysis.md)
.venv-paper/bin/nlosim report $(foreach name,$(2),runs/$(name)$(SUFFIX)) --page runs/$(5)$(SUFFIX).html

endef

paper:  ## the paper's Table II and Figures 7 to 10, docs/relay-study.md and docs/collision-study.md, and the README's tables
	$(MAKE) paper-relay
	$(MAKE) paper-collision
	$(if $(SEEDS),,.venv-paper/bin/python -m studies.readme README.md docs/results)

paper-relay: .venv-paper/installed  ## Table II, Figures 7 and 8 of the paper, and docs/relay-study.md
	.venv-paper/bin/nlosim experiment studies/relay/experiments/paper_relay.yaml --out $(PAPER) $(if $(SEEDS),--seeds $(SEEDS)) $(if $(wildcard $(PAPER)/experiment.json),--resume)
ifdef SEEDS
	.venv-paper/bin/python -m studies.relay $(PAPER)/relay-study.md $(PAPER)/report
else
	mkdir -p docs/results
	cp $(PAPER)/report/* docs/results/
	$(RELAY_PAGE)
endif

paper-collision: .venv-paper/installed  ## Figures 9 and 10 of the paper, and docs/collision-study.md
	$(call study,collision,$(COLLISION),studies.collision,collision,collision-study)

paper-point-transformer: .venv-train/installed  ## how the network in COOPERNAUT's shape drives, for docs/physics-policy.md
	.venv-train/bin/nlosim experiment studies/collision/experiments/point_transformer.yaml --out runs/point_transformer$(SUFFIX) $(if $(SEEDS),--seeds $(SEEDS)) $(if $(wildcard runs/point_transformer$(SUFFIX)/experiment.json),--resume)
ifndef SEEDS
	cp runs/point_transformer/summary.csv docs/results/point_transformer_summary.csv
endif

paper-lasting: .venv-paper/installed  ## Figures 9 and 10 where the obstruction lasts through the decision, and docs/collision-lasting.md
	$(call study,collision,$(LASTING),studies.lasting,lasting,collision-lasting)

paper-readings: .venv-paper/installed  ## Table II under other readings, where MoHeD is better, and docs/relay-readings.md
	$(if $(SEEDS),mkdir -p runs/relay-readings$(SUFFIX) && cp docs/results/relay_runs.csv runs/relay-readings$(SUFFIX)/)
	$(call study,relay,$(READINGS),studies.relay.readings_page,relay-readings,relay-readings)

paper-sensitivity: .venv-paper/installed  ## what the result of the relay study depends on, for its page
	.venv-paper/bin/nlosim experiment studies/relay/experiments/relay_sensitivity.yaml --out runs/relay_sensitivity $(if $(wildcard runs/relay_sensitivity/experiment.json),--resume)
	cp runs/relay_sensitivity/report/* docs/results/
	$(RELAY_PAGE)

paper-generalisation: .venv-paper/installed .venv-train/installed  ## policies in every encounter and variation, and docs/generalisation-study.md
	$(call study,generalisation,$(GENERALISATION),studies.generalisation,generalisation,generalisation-study)

SHARING = sharing_methods sharing_load sharing_errors sharing_egos

define run_sharing
.venv-apmm/bin/nlosim experiment studies/sharing/experiments/$(1).yaml --out runs/$(1) $(if $(wildcard runs/$(1)/experiment.json),--resume)
cp runs/$(1)/report/* docs/results/

endef

apmm: .venv-apmm/installed  ## whom to ask: how good the match is in traffic, and docs/apmm-study.md
	mkdir -p docs/results
	.venv-apmm/bin/python -m studies.sharing.moments docs/results --seeds 20
	$(foreach name,$(SHARING),$(call run_sharing,$(name)))
	.venv-apmm/bin/python -m studies.sharing docs/apmm-study.md docs/results docs/results/apmm-analysis.md

costs: .venv-costs/installed  ## what the experiments of the studies cost, and docs/study-costs.md
	OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 .venv-costs/bin/python -m studies.costs docs/study-costs.md docs/results

paper-oracle: .venv-paper/installed  ## how much of the oracle's lead is luck, for the page of the relay study
	$(foreach name,$(ORACLE),$(call run_study,relay,$(name)))
	$(if $(SEEDS),mkdir -p runs/oracle$(SUFFIX) && cp docs/results/relay_runs.csv runs/oracle$(SUFFIX)/)
	.venv-paper/bin/python -m studies.relay.foresight $(if $(SEEDS),runs/oracle$(SUFFIX),docs/results) $(foreach name,$(ORACLE),runs/$(name)$(SUFFIX))
	$(if $(SEEDS),,$(RELAY_PAGE))

# All networks that come with the package, or some: make train NETWORKS='bev_32 blind'. It goes on where it was
# interrupted; remove runs/train-* to begin anew.
NETWORKS ?= bev_16 bev_32 blind early_fusion
TRAINED = training.csv training.svg phases.csv provenance.json

define run_training
.venv-train/bin/nlosim train studies/training/recipes/$(1).yaml --out runs/train-$(1) $(if $(wildcard runs/train-$(1)/training.json),--resume)
mkdir -p docs/results/training
$(foreach file,$(TRAINED),cp runs/train-$(1)/$(file) docs/results/training/$(1)-$(file)
)
endef

train: .venv-train/installed  ## the networks in fmus/driving/network/checkpoints, by the recipes in studies/training/recipes/
	$(foreach name,$(NETWORKS),$(call run_training,$(name)))

# Networks of several encounters and of overtaking, three seeds each; the expert drives once for all that meet the same.
# It goes on where it was interrupted; remove runs/train-general_* and runs/train-overtaking_* to begin anew.
GENERAL ?= general_32 general_16 general_blind general_early_fusion overtaking_32 overtaking_16 overtaking_blind
SEVERAL = seeds.csv spread.csv

define run_general
.venv-train/bin/nlosim train studies/training/recipes/$(1).yaml --seeds 1..3 --cache runs/expert --out runs/train-$(1) $(if $(wildcard runs/train-$(1)),--resume)
mkdir -p docs/results/training
$(foreach file,$(SEVERAL),cp runs/train-$(1)/$(file) docs/results/training/$(1)-$(file)
)
$(foreach file,$(TRAINED) evaluation.csv,cp runs/train-$(1)/seed-1/$(file) docs/results/training/$(1)-$(file)
)
endef

general: .venv-train/installed  ## networks of several encounters, three seeds each; days on two cores
	$(foreach name,$(GENERAL),$(call run_general,$(name)))

verify: .venv-demo/installed  ## compare the channel with golden data; GOLDEN=DIR also makes docs/validation-channel.md
	.venv-demo/bin/nlosim verify channel --golden $(or $(GOLDEN),tests/studies/verification/channel/golden) $(if $(GOLDEN),--figures docs/validation)

# CASES=small is one fault of each kind. All of them also make docs/reliability.md, and go on where they were
# interrupted; remove runs/faults to begin anew.
verify-faults: .venv-test/installed  ## 260 random faults in random runs, for docs/reliability.md; CASES=small is quick
	$(if $(filter small,$(CASES)),rm -rf runs/faults-small runs/faults-hosts-small)
	.venv-test/bin/python -m tests.faults $(if $(filter small,$(CASES)),--small --out runs/faults-small,--docs)
	.venv-test/bin/python -m tests.faults --hosts $(if $(filter small,$(CASES)),--small --out runs/faults-hosts-small,--docs)

# N breaks (300), drawn with SEED (1), of one AREA only, in MINUTES: see docs/mutation.md. It goes on where it was
# interrupted, in build/mutation, or from docs/results/mutation.csv. Without N and AREA it makes docs/mutation.md; AGAIN=1
# also tries what survived once more; NEAR=1 measures nothing: the tests near each break alone are run; BY='FILES' tries
# what survived by the tests of these files, OF='PATTERN' only breaks of these sources
verify-mutation: .venv-mutation/installed  ## break the code in N places (SEED, AREA) and see if tests notice; makes docs/mutation.md
	.venv-mutation/bin/python -m tests.mutation $(if $(N),-n $(N)) $(if $(SEED),--seed $(SEED)) $(if $(AREA),--area $(AREA)) $(if $(AGAIN),--again) $(if $(NEAR),--near) $(if $(BY),--by $(BY)) $(if $(OF),--of '$(OF)') $(if $(MINUTES),--minutes $(MINUTES)) $(if $(N)$(AREA),,--docs)

# It goes on where it was interrupted, or where docs/results/reliability.csv says; ANEW=1 begins anew. AREA=NAME is one
# part of it, CASES=N so many cases of each. `make verify-faults` is its part about runs that go on for a while, and has a target of its own.
CASES_OF_RELIABILITY = $(or $(CASES),full)
RELIABILITY_OUT = $(if $(filter small,$(CASES)),runs/reliability-small.csv,docs/results/reliability.csv)

verify-reliability: .venv-test/installed  ## attack everything, for docs/reliability.md; CASES=small takes minutes, AREA=NAME a part
	.venv-test/bin/python -m tests.reliability $(AREA) --cases $(CASES_OF_RELIABILITY) $(if $(SEED),--seed $(SEED)) $(if $(ANEW),--anew) --out $(RELIABILITY_OUT)
	$(if $(filter small,$(CASES)),,.venv-test/bin/python -m tests.reliability.page)

verify-perception: .venv-test/installed  ## compare blind zones and sharers with geometry; makes docs/validation-perception.md
	.venv-test/bin/nlosim verify perception --figures docs/validation-perception

net: .venv-net/installed  ## make the nets of the scenes and of the cities again
	set -e; for scene in red_light red_light_skewed pedestrian left_turn platoon overtaking; do \
	  cd scenarios/assets/$$scene; \
	  ../../../.venv-net/bin/netconvert -c $$scene.netccfg; \
	  $(PYTHON) -c 'import pathlib, re, sys; p = pathlib.Path(sys.argv[1]); p.write_text(re.sub(r"<!-- generated.*?-->\n", "", p.read_text(), flags=re.DOTALL))' $$scene.net.xml; \
	  cd ../../..; \
	done
	.venv-net/bin/python -m scenarios.assets.city.make

figures: .venv-apmm/installed  ## draw the figures of the manual again, from the tables beside them
	.venv-apmm/bin/python -m studies.figures docs

clean:  ## remove environments, caches and built FMUs
	rm -rf .venv-* build dist runs .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find fmus -name '*.fmu' -delete
