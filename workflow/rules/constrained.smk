rule category_statistics:
    input:
        neumerl=NEUMERL,
        sources=SOURCES_STORE,
    output:
        fields="results/categories/statistics.csv",
        sources="results/categories/sources.csv",
    log:
        "results/logs/category_statistics.log",
    benchmark:
        "results/benchmarks/category_statistics.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("category_statistics"),
        f_diffuse=config["constrained"]["rules"]["f_diffuse"],
    script:
        "../scripts/category_statistics.py"


rule categories:
    input:
        fields="results/categories/statistics.csv",
        sources="results/categories/sources.csv",
    output:
        categories=report(
            "results/tables/categories.csv",
            caption="../report/categories.rst",
            category="Categories",
        ),
        readings=report(
            "results/tables/category_readings.csv",
            caption="../report/category_readings.rst",
            category="Categories",
        ),
        overlap=report(
            "results/tables/category_overlap.csv",
            caption="../report/category_overlap.rst",
            category="Categories",
        ),
        names=report(
            "results/tables/category_names.csv",
            caption="../report/category_names.rst",
            category="Categories",
        ),
    log:
        "results/logs/categories.log",
    benchmark:
        "results/benchmarks/categories.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("categories"),
        types=contents("config/types.tsv"),
        rules=config["constrained"]["rules"],
    script:
        "../scripts/categories.py"


rule category_figures:
    input:
        sources="results/categories/sources.csv",
    output:
        by_type=report(
            "results/figures/statistics-by-type.png",
            caption="../report/statistics.rst",
            category="Categories",
        ),
        by_material=report(
            "results/figures/statistics-by-material.png",
            caption="../report/statistics.rst",
            category="Categories",
        ),
        kmeans=report(
            "results/figures/kmeans.png",
            caption="../report/kmeans.rst",
            category="Categories",
        ),
        table="results/tables/kmeans.csv",
    log:
        "results/logs/category_figures.log",
    benchmark:
        "results/benchmarks/category_figures.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("category_figures"),
        types=contents("config/types.tsv"),
    script:
        "../scripts/category_figures.py"


# By rejection from the unconditional model, or, under guided/, from the conditional one asked for the category.
rule constrained:
    input:
        branch(
            lambda wildcards: wildcards.way == "",
            then="results/models/parity/hyperdiffusion.safetensors",
            otherwise=CONDITIONAL,
        ),
    output:
        "results/constrained/{way,|guided/}{category}.h5",
    log:
        "results/logs/constrained/{way}{category}.log",
    benchmark:
        "results/benchmarks/constrained/{way}{category}.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("constrained"),
        constrained=section("constrained", "categories"),
        guidance=config["conditional"]["guidance"]["category"],
        sampling=config["generative"]["sampling"],
    script:
        "../scripts/constrained.py"


rule constrained_sheet:
    input:
        "results/constrained/{way}{category}.h5",
    output:
        report(
            "results/constrained/{way,|guided/}{category}.png",
            caption="../report/constrained_sheet.rst",
            category="Constrained",
        ),
    log:
        "results/logs/constrained_sheet/{way}{category}.log",
    benchmark:
        "results/benchmarks/constrained_sheet/{way}{category}.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("constrained_sheet"),
        size=config["render"]["grid_size"],
        samples=config["render"]["grid_samples"],
    script:
        "../scripts/constrained_sheet.py"


rule by_category:
    input:
        expand(
            "results/constrained/{category}.h5",
            category=config["constrained"]["categories"],
        ),
    output:
        report(
            "results/figures/by-category.png",
            caption="../report/by_category.rst",
            category="Constrained",
        ),
    log:
        "results/logs/by_category.log",
    benchmark:
        "results/benchmarks/by_category.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("by_category"),
        size=config["render"]["grid_size"],
        samples=config["render"]["grid_samples"],
    script:
        "../scripts/by_category.py"


rule constrained_table:
    input:
        found=expand(
            "results/constrained/{way}{category}.h5",
            way=["", "guided/"],
            category=config["constrained"]["categories"],
        ),
        statistics="results/categories/statistics.csv",
        neumerl=NEUMERL,
        manifest=MANIFEST,
        sources=SOURCES_STORE,
    output:
        table=report(
            "results/tables/constrained.csv",
            caption="../report/constrained.rst",
            category="Constrained",
        ),
        chart=report(
            "results/charts/constrained.png",
            caption="../report/chart_constrained.rst",
            category="Charts",
        ),
    log:
        "results/logs/constrained_table.log",
    benchmark:
        "results/benchmarks/constrained_table.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("constrained_table"),
        rules=config["constrained"]["rules"],
        entries=config["evaluate"]["entries"],
        seed=config["seed"],
    script:
        "../scripts/constrained_table.py"
