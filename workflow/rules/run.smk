# Wall time, CPU time and peak memory of every stage so far, written when all else of a target is done.
rule run_table:
    input:
        lambda wildcards: targets(wildcards.target.lstrip("-") or "all"),
    output:
        report(
            "results/tables/run{target,|-charts|-generalisation|-btf|-btf_all}.csv",
            caption="../report/run.rst",
            category="Run",
        ),
    log:
        "results/logs/run_table{target}.log",
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("run_table"),
        shards=SHARDS,
    script:
        "../scripts/run_table.py"
