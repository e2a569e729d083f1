# `make demo` and `make test` need Python 3.11+ and the package index, nothing else: each makes
# its own virtual environment. The FMUs are compiled during installation by ziglang, a compiler
# from the package index.
PYTHON ?= python3

.PHONY: demo test lint docs bench paper paper-sensitivity verify verify-perception network fmus clean

demo: .venv-demo/installed  ## run the red-light scenario, closed loop, from nothing
	.venv-demo/bin/nlosim run scenarios/red_light.yaml

test: .venv-test/installed  ## everything that CI checks
	.venv-test/bin/ruff check .
	.venv-test/bin/ruff format --check .
	.venv-test/bin/mypy
	.venv-test/bin/lint-imports
	.venv-test/bin/python -m pytest

.venv-demo/installed: pyproject.toml hatch_build.py $(shell find fmus -name '*.[ch]' -o -name 'interface.py' -o -path 'fmus/common/*.py')
	$(PYTHON) -c 'import sys; sys.exit("Python 3.11 or newer is needed; set PYTHON=python3.x") if sys.version_info < (3, 11) else None'
	$(PYTHON) -m venv .venv-demo
	.venv-demo/bin/python -m pip install --quiet --disable-pip-version-check --editable .
	touch $@

.venv-test/installed: pyproject.toml hatch_build.py $(shell find fmus -name '*.[ch]' -o -name 'interface.py' -o -path 'fmus/common/*.py')
	$(PYTHON) -c 'import sys; sys.exit("Python 3.11 or newer is needed; set PYTHON=python3.x") if sys.version_info < (3, 11) else None'
	$(PYTHON) -m venv .venv-test
	.venv-test/bin/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	touch $@

.venv-bench/installed: pyproject.toml hatch_build.py $(shell find fmus -name '*.[ch]' -o -name 'interface.py' -o -path 'fmus/common/*.py')
	$(PYTHON) -c 'import sys; sys.exit("Python 3.11 or newer is needed; set PYTHON=python3.x") if sys.version_info < (3, 11) else None'
	$(PYTHON) -m venv .venv-bench
	.venv-bench/bin/python -m pip install --quiet --disable-pip-version-check --editable '.[bench]'
	touch $@

bench: .venv-bench/installed  ## measure, and make docs/benchmarks.md; keep the machine quiet
	mkdir -p docs/results
	.venv-bench/bin/nlosim bench channel --json > docs/results/bench-channel.json
	.venv-bench/bin/nlosim bench lidar --json > docs/results/bench-lidar.json
	.venv-bench/bin/python -m benchmarks.page docs/benchmarks.md docs/results/bench-channel.json docs/results/bench-lidar.json

.venv-paper/installed: pyproject.toml hatch_build.py $(shell find fmus -name '*.[ch]' -o -name 'interface.py' -o -path 'fmus/common/*.py')
	$(PYTHON) -c 'import sys; sys.exit("Python 3.11 or newer is needed; set PYTHON=python3.x") if sys.version_info < (3, 11) else None'
	$(PYTHON) -m venv .venv-paper
	.venv-paper/bin/python -m pip install --quiet --disable-pip-version-check --editable '.[experiment]'
	touch $@

# SEEDS=1..5 is a quick look in a directory of its own, without docs; without SEEDS it is the study.
# Both go on where they were interrupted; remove the directory to begin anew.
RELAY_PAGE = .venv-paper/bin/python -m fmus.evaluation.relay_study docs/relay-study.md docs/results docs/results/relay-analysis.md
PAPER = runs/paper_relay$(if $(SEEDS),-$(SEEDS))

paper: .venv-paper/installed  ## Table II, Figures 7 and 8 of the paper, and docs/relay-study.md
	.venv-paper/bin/nlosim experiment experiments/paper_relay.yaml --out $(PAPER) $(if $(SEEDS),--seeds $(SEEDS)) $(if $(wildcard $(PAPER)/experiment.json),--resume)
ifdef SEEDS
	.venv-paper/bin/python -m fmus.evaluation.relay_study $(PAPER)/relay-study.md $(PAPER)/report
else
	mkdir -p docs/results
	cp $(PAPER)/report/* docs/results/
	$(RELAY_PAGE)
endif

paper-sensitivity: .venv-paper/installed  ## what the result of the relay study depends on, for its page
	.venv-paper/bin/nlosim experiment experiments/relay_sensitivity.yaml --out runs/relay_sensitivity $(if $(wildcard runs/relay_sensitivity/experiment.json),--resume)
	cp runs/relay_sensitivity/report/* docs/results/
	$(RELAY_PAGE)

verify: .venv-demo/installed  ## compare the channel with golden data; GOLDEN=DIR also makes docs/validation-channel.md
	.venv-demo/bin/nlosim verify channel --golden $(or $(GOLDEN),tests/fmus/channel_verification/golden) $(if $(GOLDEN),--figures docs/validation)

verify-perception: .venv-test/installed  ## compare blind zones and sharers with geometry; makes docs/validation-perception.md
	.venv-test/bin/nlosim verify perception --figures docs/validation-perception

network:  ## regenerate the road network of the red-light scene (needs netconvert)
	$(PYTHON) -m venv .venv-network
	.venv-network/bin/python -m pip install --quiet 'eclipse-sumo==1.28.0'
	cd scenarios/assets/red_light && ../../../.venv-network/bin/netconvert -c red_light.netccfg
	cd scenarios/assets/red_light && $(PYTHON) -c 'import pathlib, re; p = pathlib.Path("red_light.net.xml"); p.write_text(re.sub(r"<!-- generated.*?-->\n", "", p.read_text(), flags=re.DOTALL))'

clean:  ## remove environments, caches and built FMUs
	rm -rf .venv-* build dist runs .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find fmus -name '*.fmu' -delete
