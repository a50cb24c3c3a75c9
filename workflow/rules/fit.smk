rule fit_first:
    input:
        augmerl=STORE,
        sources=SOURCES_STORE,
    output:
        "results/neumerl/first.h5",
    log:
        "results/logs/fit_first.log",
    benchmark:
        "results/benchmarks/fit_first.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("fit_first"),
        fit=section("fit", "materials_per_job", "independent", "measured", "dense"),
        seed=config["seed"],
    script:
        "../scripts/fit_first.py"


rule fit_shard:
    input:
        augmerl=STORE,
        sources=SOURCES_STORE,
        first="results/neumerl/first.h5",
    output:
        "results/neumerl/shards/{scatteritem}.h5",
    log:
        "results/logs/fit_shard/{scatteritem}.log",
    benchmark:
        "results/benchmarks/fit_shard/{scatteritem}.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=15,
    params:
        code=code("fit_shard"),
        fit=section("fit", "materials_per_job", "measured", "dense"),
        indices=shard_indices,
        seed=config["seed"],
    script:
        "../scripts/fit_shard.py"


rule fit_gather:
    input:
        shards=gather.fit("results/neumerl/shards/{scatteritem}.h5"),
        manifest=MANIFEST,
    output:
        NEUMERL,
    log:
        "results/logs/fit_gather.log",
    benchmark:
        "results/benchmarks/fit_gather.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("fit_gather"),
    script:
        "../scripts/fit_gather.py"


# Measured materials, fitted as a user's own: the folder that the config names, or a row that says there is none.
rule fit_measured:
    input:
        first="results/neumerl/first.h5",
        files=MEASURED,
    output:
        "results/tables/fit-measured.csv",
    log:
        "results/logs/fit_measured.log",
    benchmark:
        "results/benchmarks/fit_measured.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        code=code("fit_measured"),
        fit=section("fit", "materials_per_job", "independent", "measured", "dense"),
        size=config["render"]["size"],
        seed=config["seed"],
    script:
        "../scripts/fit_measured.py"


rule fit_quality:
    input:
        measured="results/tables/fit-measured.csv",
        neumerl=NEUMERL,
        augmerl=STORE,
        sources=SOURCES_STORE,
    output:
        table="results/tables/fit.csv",
        summary=report(
            "results/tables/fit-summary.csv",
            caption="../report/fit_quality.rst",
            category="Fields",
        ),
    log:
        "results/logs/fit_quality.log",
    benchmark:
        "results/benchmarks/fit_quality.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=2500,
        runtime=10,
    params:
        code=code("fit_quality"),
        size=config["render"]["size"],
        seed=config["seed"],
    script:
        "../scripts/fit_quality.py"
