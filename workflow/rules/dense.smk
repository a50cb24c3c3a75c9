# The dense set: more bases than the paper's, drawn from the sources and fitted from their parents' fields.
rule dense_recipe:
    input:
        manifest=MANIFEST,
        neumerl=NEUMERL,
    output:
        "results/augmerl/dense.tsv",
    log:
        "results/logs/dense_recipe.log",
    benchmark:
        "results/benchmarks/dense_recipe.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("dense_recipe"),
        dense=config["augment"]["dense"],
        seed=config["seed"],
    script:
        "../scripts/dense_recipe.py"


rule dense_shard:
    input:
        recipe="results/augmerl/dense.tsv",
        sources=SOURCES_STORE,
        neumerl=NEUMERL,
    output:
        "results/neumerl/dense/{scatteritem}.h5",
    log:
        "results/logs/dense_shard/{scatteritem}.log",
    benchmark:
        "results/benchmarks/dense_shard/{scatteritem}.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=15,
    params:
        code=code("dense_shard"),
        fit={
            key: config["fit"][key]
            for key in ("highlight_share", "schedule", "precision", "dense")
        },
        indices=dense_shard_indices,
        seed=config["seed"],
    script:
        "../scripts/dense_shard.py"


rule dense_gather:
    input:
        shards=gather.dense("results/neumerl/dense/{scatteritem}.h5"),
        recipe="results/augmerl/dense.tsv",
    output:
        DENSE,
    log:
        "results/logs/dense_gather.log",
    benchmark:
        "results/benchmarks/dense_gather.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("dense_gather"),
    script:
        "../scripts/dense_gather.py"


# What fits of dense bases cost, beside those of the paper's bases, on the same ones.
rule dense_table:
    input:
        recipe="results/augmerl/dense.tsv",
        dense=DENSE,
        sources=SOURCES_STORE,
        neumerl=NEUMERL,
        first="results/neumerl/first.h5",
    output:
        report(
            "results/tables/dense.csv",
            caption="../report/dense.rst",
            category="Charts",
        ),
    log:
        "results/logs/dense_table.log",
    benchmark:
        "results/benchmarks/dense_table.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=30,
    params:
        code=code("dense_table"),
        fit=section("fit", "materials_per_job", "independent", "measured"),
        materials=config["charts"]["dense_materials"],
        seed=config["seed"],
    script:
        "../scripts/dense_table.py"
