# Surfaces are files of config/btf. What fits and tables take their values from is captured in sweeps, some in each job.
rule btf_shard:
    input:
        lambda wildcards: facet_inputs(wildcards.surface),
    output:
        temp("results/btf/shards/{surface}/{capture}/{shard}-of-{shards}.h5"),
    log:
        "results/logs/btf_shard/{surface}/{capture}/{shard}-of-{shards}.log",
    benchmark:
        "results/benchmarks/btf_shard/{surface}/{capture}/{shard}-of-{shards}.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=4000,
        runtime=60,
    params:
        code=code("btf_shard"),
        surface=lambda wildcards: surface_of(wildcards.surface),
        stores=lambda wildcards: facet_stores(wildcards.surface),
        settings=lambda wildcards: capture_settings(
            wildcards.capture, wildcards.surface
        ),
        seed=config["seed"],
    script:
        "../scripts/btf_shard.py"


# A measured surface: its file, read.
rule btf_measured:
    input:
        lambda wildcards: surface_of(wildcards.surface)["file"],
    output:
        "results/btf/measured/{surface}.h5",
    log:
        "results/logs/btf_measured/{surface}.log",
    benchmark:
        "results/benchmarks/btf_measured/{surface}.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        code=code("btf_measured"),
        options=lambda wildcards: {
            key: surface_of(wildcards.surface)[key]
            for key in ("cosine", "rows", "scale", "size_mm", "gamma")
        },
    script:
        "../scripts/btf_measured.py"


# The shards of a captured surface, put together; of a measured one, its pictures or random values of them.
rule btf_capture:
    input:
        lambda wildcards: captured_from(wildcards.surface, wildcards.capture),
    output:
        "results/btf/captures/{surface}/{capture}.h5",
    log:
        "results/logs/btf_capture/{surface}/{capture}.log",
    benchmark:
        "results/benchmarks/btf_capture/{surface}/{capture}.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=30,
    params:
        code=code("btf_capture"),
        surface=lambda wildcards: surface_of(wildcards.surface),
        settings=lambda wildcards: measured_settings(wildcards.surface),
        seed=config["seed"],
    script:
        "../scripts/btf_capture.py"


# A patch of the same surface that is larger than the exemplar: what synthesis should look like.
rule btf_truth:
    input:
        lambda wildcards: facet_inputs(wildcards.surface),
    output:
        "results/btf/truth/{surface}-{extent}x.h5",
    log:
        "results/logs/btf_truth/{surface}-{extent}x.log",
    benchmark:
        "results/benchmarks/btf_truth/{surface}-{extent}x.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=5000,
        runtime=60,
    params:
        code=code("btf_truth"),
        surface=lambda wildcards: surface_of(wildcards.surface),
        stores=lambda wildcards: facet_stores(wildcards.surface),
        settings=lambda wildcards: truth_settings(
            wildcards.surface, int(wildcards.extent)
        ),
        seed=config["seed"],
    script:
        "../scripts/btf_truth.py"


rule btf_fit:
    input:
        lambda wildcards: f"results/btf/captures/{wildcards.surface}/{captured_for(wildcards.representation)}.h5",
    output:
        model="results/btf/models/{surface}/{representation}.safetensors",
        cost="results/btf/models/{surface}/{representation}.csv",
    log:
        "results/logs/btf_fit/{surface}/{representation}.log",
    benchmark:
        "results/benchmarks/btf_fit/{surface}/{representation}.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=5000,
        runtime=60,
    params:
        code=code("btf_fit"),
        hyperparameters=lambda wildcards: representation_of(wildcards.representation),
        seed=config["seed"],
    script:
        "../scripts/btf_fit.py"


rule btf_quality:
    input:
        model="results/btf/models/{surface}/{representation}.safetensors",
        cost="results/btf/models/{surface}/{representation}.csv",
        queries=lambda wildcards: f"results/btf/captures/{judged_by(wildcards.surface)}/queries.h5",
        held_out=lambda wildcards: f"results/btf/captures/{judged_by(wildcards.surface)}/held-out.h5",
    output:
        "results/btf/quality/{surface}/{representation}.csv",
    log:
        "results/logs/btf_quality/{surface}/{representation}.log",
    benchmark:
        "results/benchmarks/btf_quality/{surface}/{representation}.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=15,
    params:
        code=code("btf_quality"),
        held_out=config["btf"]["held_out"],
        seed=config["seed"],
    script:
        "../scripts/btf_quality.py"


rule btf_synthesis:
    input:
        models=expand(
            "results/btf/models/{{surface}}/{representation}.safetensors",
            representation=SYNTHESISED,
        ),
        queries="results/btf/captures/{surface}/queries.h5",
        truth=lambda wildcards: truth_of(wildcards.surface, BTF["truth"]["extent"]),
    output:
        "results/btf/synthesis/{surface}.csv",
    log:
        "results/logs/btf_synthesis/{surface}.log",
    benchmark:
        "results/benchmarks/btf_synthesis/{surface}.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=4000,
        runtime=60,
    params:
        code=code("btf_synthesis"),
        names=SYNTHESISED,
        methods=config["btf"]["synthesis"]["methods"],
        default=lambda wildcards: default_synthesis(wildcards.surface),
        seed=config["seed"],
    script:
        "../scripts/btf_synthesis.py"


# The default fit of a surface: its planes, and its pictures beside captured ones.
rule btf_ours:
    input:
        model="results/btf/models/{surface}/ours.safetensors",
        queries="results/btf/captures/{surface}/queries.h5",
        held_out="results/btf/captures/{surface}/held-out.h5",
    output:
        planes="results/btf/figures/{surface}-planes.png",
        fits=report(
            "results/btf/figures/{surface}-ours.png",
            caption="../report/btf_ours.rst",
            category="Surfaces",
        ),
        endless="results/btf/figures/{surface}-endless.png",
    log:
        "results/logs/btf_ours/{surface}.log",
    benchmark:
        "results/benchmarks/btf_ours/{surface}.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=15,
    params:
        code=code("btf_ours"),
        pairs=config["btf"]["pairs"],
        method=lambda wildcards: default_synthesis(wildcards.surface),
        seed=config["seed"],
    script:
        "../scripts/btf_ours.py"


rule btf_synthesised:
    input:
        model="results/btf/models/{surface}/ours.safetensors",
        queries="results/btf/captures/{surface}/queries.h5",
        truth=lambda wildcards: truth_of(
            wildcards.surface, shown_of(int(wildcards.extent))
        ),
    output:
        report(
            "results/btf/figures/{surface}-synthesis-{extent}x.png",
            caption="../report/btf_synthesised.rst",
            category="Surfaces",
        ),
    log:
        "results/logs/btf_synthesised/{surface}-{extent}x.log",
    benchmark:
        "results/benchmarks/btf_synthesised/{surface}-{extent}x.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=4000,
        runtime=30,
    params:
        code=code("btf_synthesised"),
        methods=config["btf"]["synthesis"]["methods"],
        pairs=config["btf"]["pairs"],
        seed=config["seed"],
    script:
        "../scripts/btf_synthesised.py"


# Every representation's pictures of a surface, and two of them tiled and synthesised.
rule btf_compared:
    input:
        models=expand(
            "results/btf/models/{{surface}}/{representation}.safetensors",
            representation=config["btf"]["compared"],
        ),
        queries="results/btf/captures/{surface}/queries.h5",
        held_out="results/btf/captures/{surface}/held-out.h5",
    output:
        fits="results/btf/figures/{surface}-representations.png",
        tiled="results/btf/figures/{surface}-tiled.png",
    log:
        "results/logs/btf_compared/{surface}.log",
    benchmark:
        "results/benchmarks/btf_compared/{surface}.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=4000,
        runtime=30,
    params:
        code=code("btf_compared"),
        names=list(config["btf"]["compared"]),
        pairs=config["btf"]["pairs"],
        method=lambda wildcards: default_synthesis(wildcards.surface),
        extent=config["btf"]["truth"]["wide"],
        seed=config["seed"],
    script:
        "../scripts/btf_compared.py"


rule btf_tables:
    input:
        representations=expand(
            "results/btf/quality/{surface}/{representation}.csv",
            surface=config["btf"]["surfaces"],
            representation=config["btf"]["compared"],
        ),
        synthesis=expand(
            "results/btf/synthesis/{surface}.csv", surface=config["btf"]["surfaces"]
        ),
    output:
        representations=report(
            "results/btf/tables/representations.csv",
            caption="../report/btf_representations.rst",
            category="Surfaces",
        ),
        synthesis=report(
            "results/btf/tables/synthesis.csv",
            caption="../report/btf_synthesis.rst",
            category="Surfaces",
        ),
    log:
        "results/logs/btf_tables.log",
    benchmark:
        "results/benchmarks/btf_tables.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("btf_tables"),
    script:
        "../scripts/btf_tables.py"


rule btf_relief:
    input:
        expand("results/btf/quality/{fit}.csv", fit=BTF_RELIEF),
    output:
        report(
            "results/btf/tables/relief.csv",
            caption="../report/btf_relief.rst",
            category="Surfaces",
        ),
    log:
        "results/logs/btf_relief.log",
    benchmark:
        "results/benchmarks/btf_relief.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("btf_relief"),
    script:
        "../scripts/btf_relief.py"


rule btf_chart:
    input:
        expand("results/btf/quality/{fit}.csv", fit=BTF_CHART),
    output:
        table="results/btf/charts/representations.csv",
        by_bytes=report(
            "results/btf/charts/representations-bytes.png",
            caption="../report/btf_chart.rst",
            category="Surfaces",
        ),
        by_bytes_vector="results/btf/charts/representations-bytes.svg",
        by_ns=report(
            "results/btf/charts/representations-ns.png",
            caption="../report/btf_chart.rst",
            category="Surfaces",
        ),
        by_ns_vector="results/btf/charts/representations-ns.svg",
    log:
        "results/logs/btf_chart.log",
    benchmark:
        "results/benchmarks/btf_chart.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("btf_chart"),
    script:
        "../scripts/btf_chart.py"


rule btf_stability:
    output:
        report(
            "results/btf/tables/stability.csv",
            caption="../report/btf_stability.rst",
            category="Stability",
        ),
    log:
        "results/logs/btf_stability.log",
    benchmark:
        "results/benchmarks/btf_stability.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=15,
    params:
        code=code("btf_stability"),
        surface=lambda wildcards: surface_of(BTF["stability"]["surface"]),
        settings={
            key: BTF["stability"][key] for key in BTF["stability"] if key != "surface"
        },
        seed=config["seed"],
    script:
        "../scripts/btf_stability.py"


# The rate of fits, beside that of plain PyTorch in the same run.
rule btf_bench:
    input:
        queries=f"results/btf/captures/{BTF['surface']}/queries.h5",
        held_out=f"results/btf/captures/{BTF['surface']}/held-out.h5",
    output:
        report(
            "results/btf/tables/bench.csv",
            caption="../report/btf_bench.rst",
            category="Surfaces",
        ),
    log:
        "results/logs/btf_bench.log",
    benchmark:
        "results/benchmarks/btf_bench.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=8000,
        runtime=60,
    params:
        code=code("btf_bench"),
        hyperparameters={"samples": BTF["chart"]["bench_samples"]},
        seed=config["seed"],
    script:
        "../scripts/btf_bench.py"


# What a query costs, beside plain PyTorch in the same run.
rule btf_queries:
    input:
        f"results/btf/models/{BTF['surface']}/ours.safetensors",
    output:
        report(
            "results/btf/tables/queries.csv",
            caption="../report/btf_queries.rst",
            category="Surfaces",
        ),
    log:
        "results/logs/btf_queries.log",
    benchmark:
        "results/benchmarks/btf_queries.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 2
    resources:
        mem_mb=6000,
        runtime=30,
    params:
        code=code("btf_queries"),
        torch_threads=2,
        methods=config["btf"]["synthesis"]["methods"],
        counts=config["btf"]["chart"]["queries"],
        seed=config["seed"],
    script:
        "../scripts/btf_queries.py"
