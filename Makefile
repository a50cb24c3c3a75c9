# `make` sets everything up and makes all results; `make test` runs the tests. Needs Python 3.11 with pip.
PYTHON ?= python3.11
SNAKEMAKE = .venv/bin/snakemake
STAMP = .venv/installed

.PHONY: all report charts generalisation btf btf_all packaged smoke test test-package test-workflow lint embedded readme config-table

all: $(STAMP)
	$(SNAKEMAKE)
	$(SNAKEMAKE) --report results/report.html

charts generalisation btf btf_all: $(STAMP)
	$(SNAKEMAKE) $@

# The report over what is there: the run of `all`, which is made first where it is missing, and the other targets made.
report: $(STAMP) results/tables/run.csv
	$(SNAKEMAKE) --report results/report.html -- all $(foreach t,charts generalisation btf btf_all,$(if $(wildcard results/tables/run-$t.csv),$t))

results/tables/run.csv: | $(STAMP)
	$(SNAKEMAKE)

# Every rule at toy size, in a folder of its own so that it touches no results.
smoke: $(STAMP)
	$(SNAKEMAKE) --directory results/smoke --configfile config/smoke.yaml -- smoke
	$(SNAKEMAKE) --directory results/smoke --configfile config/smoke.yaml --report report.html -- smoke

# The package and the workflow side by side; what fails is told at the end of either.
test: $(STAMP)
	$(MAKE) --jobs 2 test-package test-workflow

test-package: $(STAMP)
	OMP_NUM_THREADS=1 .venv/bin/pytest --ignore tests/workflow

test-workflow: $(STAMP)
	.venv/bin/pytest tests/workflow

lint: $(STAMP)
	.venv/bin/ruff check src tests workflow/scripts
	.venv/bin/ruff format --check src tests workflow/scripts
	.venv/bin/snakefmt --check Snakefile workflow/rules
	$(SNAKEMAKE) --lint

# Train the embedded materials again from the published NBRDFs: make embedded ZIP=merl_nbrdf.zip
embedded: $(STAMP)
	.venv/bin/python -m neumat.fields.distill $(ZIP)

# docs/results.md, the pictures of docs/ and the README's headline figures, from the run in results/.
readme: $(STAMP)
	.venv/bin/python -m neumat.reporting.docs results docs

# The model that comes with the package, and its data card, into the package and docs/.
packaged: $(STAMP)
	$(SNAKEMAKE) packaged
	cp results/packaged/model.safetensors results/packaged/model.md src/neumat/data/
	cp results/packaged/model.md docs/model.md

config-table: $(STAMP)
	.venv/bin/python -m neumat.config workflow/schemas/config.schema.json > config/README.md

$(STAMP): pyproject.toml constraints.txt
	$(PYTHON) -m venv .venv
	.venv/bin/pip install --constraint constraints.txt --editable '.[llvm,shaders,test]'
	touch $@
