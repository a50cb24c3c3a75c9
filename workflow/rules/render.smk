rule verify_renderer:
    input:
        neumerl=NEUMERL,
        manifest=MANIFEST,
    output:
        report(
            "results/tables/renderer.csv",
            caption="../report/renderer.rst",
            category="Data",
        ),
    log:
        "results/logs/verify_renderer.log",
    benchmark:
        "results/benchmarks/verify_renderer.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=2500,
        runtime=15,
    params:
        code=code("verify_renderer"),
        materials=config["render"]["verify_materials"],
        samples=config["render"]["verify_samples"],
        size=config["render"]["size"],
    script:
        "../scripts/verify_renderer.py"


rule grid:
    input:
        "results/samples/parity/hyperdiffusion.h5",
    output:
        report(
            "results/figures/grid.png",
            caption="../report/grid.rst",
            category="Samples",
        ),
    log:
        "results/logs/grid.log",
    benchmark:
        "results/benchmarks/grid.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("grid"),
        render=section("render", "size", "verify_materials", "verify_samples"),
    script:
        "../scripts/grid.py"


rule physics:
    input:
        neumerl=NEUMERL,
        samples=SAMPLES,
        requested="results/samples/conditional.h5",
    output:
        table=report(
            "results/tables/physics.csv",
            caption="../report/physics.rst",
            category="Samples",
        ),
        unfolded=report(
            "results/tables/unfolded.csv",
            caption="../report/unfolded.rst",
            category="Samples",
        ),
    log:
        "results/logs/physics.log",
    benchmark:
        "results/benchmarks/physics.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("physics"),
    script:
        "../scripts/physics.py"


# The first samples of every method of Table 2.
rule method_sheet:
    input:
        samples=expand(
            "results/samples/parity/{method}.h5",
            method=config["evaluate"]["methods"],
        ),
        neumerl=NEUMERL,
        manifest=MANIFEST,
        sources=SOURCES_STORE,
    output:
        report(
            "results/figures/methods.png",
            caption="../report/method_sheet.rst",
            category="Samples",
        ),
    log:
        "results/logs/method_sheet.log",
    benchmark:
        "results/benchmarks/method_sheet.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=2500,
        runtime=10,
    params:
        code=code("method_sheet"),
        methods=config["evaluate"]["methods"],
        size=config["render"]["grid_size"],
    script:
        "../scripts/method_sheet.py"
