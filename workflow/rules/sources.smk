if config["sources"]["url"]:

    rule download:
        output:
            "results/sources/downloaded.tsv",
        log:
            "results/logs/download.log",
        benchmark:
            "results/benchmarks/download.tsv"
        conda:
            "../envs/neumat.yaml"
        threads: 1
        resources:
            mem_mb=1000,
            runtime=150,
        params:
            code=code("download"),
            url=config["sources"]["url"],
            folder=config["sources"]["folder"],
            names=config["sources"]["names"],
        script:
            "../scripts/download.py"


rule sources:
    input:
        SOURCE_FILES,
    output:
        "results/sources/sources.h5",
    log:
        "results/logs/sources.log",
    benchmark:
        "results/benchmarks/sources.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        code=code("sources"),
        sources=section("sources", "url"),
    script:
        "../scripts/sources.py"
