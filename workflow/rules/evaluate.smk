# All methods of a protocol in one job: they share the reference set.
rule score:
    input:
        samples=lambda wildcards: [
            f"results/samples/{wildcards.protocol}/{method}.h5"
            for method in methods_of(wildcards.protocol)
        ],
        neumerl=NEUMERL,
        manifest=MANIFEST,
        sources=SOURCES_STORE,
        inception=INCEPTION,
    output:
        "results/scores/{protocol}.csv",
    log:
        "results/logs/score/{protocol}.log",
    benchmark:
        "results/benchmarks/score/{protocol}.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=4500,
        runtime=60,
    params:
        code=code("score"),
        methods=lambda wildcards: methods_of(wildcards.protocol),
        draws=config["evaluate"]["draws"],
        set_size=config["evaluate"]["set_size"],
        entries=config["evaluate"]["entries"],
        size=config["render"]["size"],
        seed=config["seed"],
    script:
        "../scripts/score.py"


rule unconditional:
    input:
        expand(
            "results/scores/{protocol}.csv",
            protocol=config["evaluate"]["protocols"],
        ),
    output:
        table=report(
            "results/tables/unconditional.csv",
            caption="../report/unconditional.rst",
            category="Table 2",
        ),
        readable="results/tables/unconditional.md",
    log:
        "results/logs/unconditional.log",
    benchmark:
        "results/benchmarks/unconditional.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("table"),
        bootstrap=config["evaluate"]["bootstrap"],
        seed=config["seed"],
    script:
        "../scripts/table.py"


use rule unconditional as generalisation_table with:
    input:
        expand(
            "results/scores/{protocol}.csv",
            protocol=UNRELATED,
        ),
    output:
        table=report(
            "results/tables/generalisation.csv",
            caption="../report/generalisation.rst",
            category="Generalisation",
        ),
        readable="results/tables/generalisation.md",
    log:
        "results/logs/generalisation_table.log",
    benchmark:
        "results/benchmarks/generalisation_table.tsv"


rule novelty_figures:
    input:
        samples="results/samples/parity/hyperdiffusion.h5",
        neumerl=NEUMERL,
        manifest=MANIFEST,
        sources=SOURCES_STORE,
    output:
        nearest=report(
            "results/figures/nearest.png",
            caption="../report/nearest.rst",
            category="Novelty",
        ),
        heatmap=report(
            "results/figures/heatmap.png",
            caption="../report/heatmap.rst",
            category="Novelty",
        ),
    log:
        "results/logs/novelty_figures.log",
    benchmark:
        "results/benchmarks/novelty_figures.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=2500,
        runtime=10,
    params:
        code=code("novelty_figures"),
        set_size=config["evaluate"]["set_size"],
        entries=config["evaluate"]["entries"],
        size=config["render"]["size"],
        seed=config["seed"],
    script:
        "../scripts/novelty_figures.py"
