# Samples of the default model against sources that it has not seen, beside nulls, and what it knows by heart.
rule coverage:
    input:
        model="results/models/{protocol}/hyperdiffusion.safetensors",
        neumerl=NEUMERL,
        manifest=MANIFEST,
        sources=SOURCES_STORE,
    output:
        coverage="results/coverage/{protocol}.csv",
        memorisation="results/coverage/{protocol}-memorisation.csv",
    log:
        "results/logs/coverage/{protocol}.log",
    benchmark:
        "results/benchmarks/coverage/{protocol}.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=2500,
        runtime=15,
    params:
        code=code("coverage"),
        sizes=config["evaluate"]["coverage"]["sizes"],
        entries=config["evaluate"]["coverage"]["entries"],
        dense={
            key: value
            for key, value in config["augment"]["dense"].items()
            if key != "count"
        },
        sampling=config["generative"]["sampling"],
        seed=config["seed"],
    script:
        "../scripts/coverage.py"


rule coverage_table:
    input:
        coverage=expand("results/coverage/{fold}.csv", fold=REPORTED),
        memorisation=expand("results/coverage/{fold}-memorisation.csv", fold=REPORTED),
    output:
        table=report(
            "results/tables/coverage.csv",
            caption="../report/coverage.rst",
            category="Coverage",
        ),
        memorisation=report(
            "results/tables/memorisation.csv",
            caption="../report/memorisation.rst",
            category="Coverage",
        ),
        chart=report(
            "results/charts/coverage.png",
            caption="../report/coverage.rst",
            category="Coverage",
        ),
        vector="results/charts/coverage.svg",
    log:
        "results/logs/coverage_table.log",
    benchmark:
        "results/benchmarks/coverage_table.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("coverage_table"),
        bootstrap=config["evaluate"]["bootstrap"],
        seed=config["seed"],
    script:
        "../scripts/coverage_table.py"


# The same over every fold. Settings were chosen on those that are not reported, so their mean flatters.
use rule coverage_table as generalisation_coverage with:
    input:
        coverage=expand("results/coverage/{fold}.csv", fold=FOLDS),
        memorisation=expand("results/coverage/{fold}-memorisation.csv", fold=FOLDS),
    output:
        table=report(
            "results/tables/generalisation_coverage.csv",
            caption="../report/coverage.rst",
            category="Generalisation",
        ),
        memorisation=report(
            "results/tables/generalisation_memorisation.csv",
            caption="../report/memorisation.rst",
            category="Generalisation",
        ),
        chart=report(
            "results/charts/generalisation_coverage.png",
            caption="../report/coverage.rst",
            category="Generalisation",
        ),
        vector="results/charts/generalisation_coverage.svg",
    log:
        "results/logs/generalisation_coverage.log",
    benchmark:
        "results/benchmarks/generalisation_coverage.tsv"
