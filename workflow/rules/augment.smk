rule augment:
    input:
        "results/sources/sources.h5",
    output:
        store=STORE,
        manifest=MANIFEST,
        table=report(
            "results/tables/augmentation.csv",
            caption="../report/augmentation.rst",
            category="Data",
        ),
    log:
        "results/logs/augment.log",
    benchmark:
        "results/benchmarks/augment.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("augment"),
        augment=section("augment", "dense"),
        seed=config["seed"],
    script:
        "../scripts/augment.py"


rule augmentation_figures:
    input:
        augmerl=STORE,
        sources=SOURCES_STORE,
    output:
        permutations=report(
            "results/figures/permutations.png",
            caption="../report/permutations.rst",
            category="Data",
        ),
        blends=report(
            "results/figures/blends.png",
            caption="../report/blends.rst",
            category="Data",
        ),
    log:
        "results/logs/augmentation_figures.log",
    benchmark:
        "results/benchmarks/augmentation_figures.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1500,
        runtime=10,
    params:
        code=code("augmentation_figures"),
        size=config["render"]["grid_size"],
    script:
        "../scripts/augmentation_figures.py"
