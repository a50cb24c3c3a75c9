rule stability_conditional:
    input:
        model=CONDITIONAL,
        neumerl=NEUMERL,
        manifest=MANIFEST,
        sources=SOURCES_STORE,
    output:
        report(
            "results/tables/stability_conditional.csv",
            caption="../report/stability_conditional.rst",
            category="Stability",
        ),
    log:
        "results/logs/stability_conditional.log",
    benchmark:
        "results/benchmarks/stability_conditional.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1500,
        runtime=10,
    params:
        code=code("stability_conditional"),
        guidance=config["conditional"]["guidance"],
        entries=config["evaluate"]["entries"],
        seed=config["seed"],
    script:
        "../scripts/stability_conditional.py"


rule stability_render:
    input:
        neumerl=NEUMERL,
        manifest=MANIFEST,
        augmerl=STORE,
        sources=SOURCES_STORE,
    output:
        report(
            "results/tables/stability_render.csv",
            caption="../report/stability_render.rst",
            category="Stability",
        ),
    log:
        "results/logs/stability_render.log",
    benchmark:
        "results/benchmarks/stability_render.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("stability_render"),
        seed=config["seed"],
    script:
        "../scripts/stability_render.py"
