# The model that comes with the package: as the conditional one, but it learns every source. `make packaged` puts it in
# its place. Its card shows the figures of the same recipe on sources that were held out; it has none of its own.
use rule projection as packaged_projection with:
    output:
        "results/packaged/projection.safetensors",
    log:
        "results/logs/packaged_projection.log",
    benchmark:
        "results/benchmarks/packaged_projection.tsv"
    params:
        protocol="everything",
        projection=config["conditional"]["projection"],


use rule tune as packaged_tune with:
    input:
        neumerl=NEUMERL,
        manifest=MANIFEST,
        conditions=CONDITIONS,
        statistics="results/categories/statistics.csv",
        projection="results/packaged/projection.safetensors",
        model="results/models/everything/hyperdiffusion.safetensors",
    output:
        "results/packaged/float32.safetensors",
    log:
        "results/logs/packaged_tune.log",
    benchmark:
        "results/benchmarks/packaged_tune.tsv"
    params:
        protocol="everything",
        checkpoint="results/packaged/float32.checkpoint",


rule pack:
    input:
        model="results/packaged/float32.safetensors",
        coverage="results/tables/coverage.csv",
        conditional="results/tables/conditional.csv",
    output:
        model="results/packaged/model.safetensors",
        card="results/packaged/model.md",
    log:
        "results/logs/pack.log",
    benchmark:
        "results/benchmarks/pack.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("pack"),
        sources=len(SOURCES),
        blends=config["augment"]["blends"],
        dense=len(DENSE_BASES) if hyperparameters_of("hyperdiffusion")["dense"] else 0,
    script:
        "../scripts/pack.py"
