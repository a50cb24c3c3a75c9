rule train:
    input:
        unpack(dense_of),
        neumerl=NEUMERL,
        manifest=MANIFEST,
        sources=SOURCES_STORE,
    output:
        "results/models/{protocol}/{method}.safetensors",
    log:
        "results/logs/train/{protocol}/{method}.log",
    benchmark:
        "results/benchmarks/train/{protocol}/{method}.tsv"
    priority: 1  # the longest jobs first, so that no core idles at the end
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=30,
    params:
        code=code("train"),
        hyperparameters=lambda wildcards: hyperparameters_of(wildcards.method),
        components=config["augment"]["components"],
        seed=config["seed"],
        checkpoint="results/models/{protocol}/{method}.checkpoint",
    script:
        "../scripts/train.py"


rule sample:
    input:
        "results/models/{protocol}/{method}.safetensors",
    output:
        "results/samples/{protocol}/{method}.h5",
    log:
        "results/logs/sample/{protocol}/{method}.log",
    benchmark:
        "results/benchmarks/sample/{protocol}/{method}.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("sample"),
        samples=config["evaluate"]["draws"] * config["evaluate"]["set_size"],
        sampling=config["generative"]["sampling"],
    script:
        "../scripts/sample.py"
