# Scenes are files of config/scenes: a layout each.
rule scene:
    input:
        neumerl=NEUMERL,
        manifest=MANIFEST,
        samples=SAMPLES,
        btfs=lambda wildcards: btfs_of(wildcards.scene),
    output:
        report(
            "results/scenes/{scene}.png",
            caption="../report/scene.rst",
            category="Scenes",
        ),
    log:
        "results/logs/scene/{scene}.log",
    benchmark:
        "results/benchmarks/scene/{scene}.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=15,
    params:
        code=code("scene"),
        layout=lambda wildcards: layout_of(wildcards.scene),
        picture={key: config["scenes"][key] for key in ("width", "height", "samples")},
    script:
        "../scripts/scene.py"


use rule scene as scene_preview with:
    output:
        "results/scenes/preview/{scene}.png",
    log:
        "results/logs/scene_preview/{scene}.log",
    benchmark:
        "results/benchmarks/scene_preview/{scene}.tsv"
    params:
        code=code("scene"),
        layout=lambda wildcards: layout_of(wildcards.scene),
        picture={
            "width": config["scenes"]["width"] // 2,
            "height": config["scenes"]["height"] // 2,
            "samples": config["scenes"]["preview_samples"],
        },


# Every fitted and every sampled material.
rule contact_sheet:
    input:
        neumerl=NEUMERL,
        samples=SAMPLES,
    output:
        "results/figures/contact.png",
    log:
        "results/logs/contact_sheet.log",
    benchmark:
        "results/benchmarks/contact_sheet.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("contact_sheet"),
        size=config["render"]["contact_size"],
        columns=config["render"]["contact_columns"],
    script:
        "../scripts/contact_sheet.py"


# What a scene needs of its materials: fits under its own queries, and the cheapest models for each tolerance.
rule scene_models:
    input:
        augmerl=STORE,
        sources=SOURCES_STORE,
        neumerl=NEUMERL,
        manifest=MANIFEST,
        samples=SAMPLES,
    output:
        models="results/scenes/{scene}-models.csv",
        fits="results/scenes/{scene}-fits.csv",
    log:
        "results/logs/scene_models/{scene}.log",
    benchmark:
        "results/benchmarks/scene_models/{scene}.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=90,
    params:
        code=code("scene_models"),
        layout=lambda wildcards: layout_of(wildcards.scene),
        settings=section("scenes", "names", "samples", "preview_samples", "tolerance"),
        seed=config["seed"],
    script:
        "../scripts/scene_models.py"


rule chart_models:
    input:
        models=expand(
            "results/scenes/{scene}-models.csv", scene=config["scenes"]["names"]
        ),
        fits=expand("results/scenes/{scene}-fits.csv", scene=config["scenes"]["names"]),
    output:
        table="results/charts/models.csv",
        chart=report(
            "results/charts/models.png",
            caption="../report/chart_models.rst",
            category="Charts",
        ),
        vector="results/charts/models.svg",
        chosen=report(
            "results/tables/scene_models.csv",
            caption="../report/scene_models.rst",
            category="Scenes",
        ),
        fits=report(
            "results/tables/scene_fits.csv",
            caption="../report/scene_fits.rst",
            category="Scenes",
        ),
    log:
        "results/logs/chart_models.log",
    benchmark:
        "results/benchmarks/chart_models.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("chart_models"),
        scenes=config["scenes"]["names"],
        tolerance=config["scenes"]["tolerance"],
    script:
        "../scripts/chart_models.py"


rule ladder:
    input:
        augmerl=STORE,
        sources=SOURCES_STORE,
        neumerl=NEUMERL,
        manifest=MANIFEST,
    output:
        report(
            "results/tables/ladder.csv",
            caption="../report/ladder.rst",
            category="Scenes",
        ),
    log:
        "results/logs/ladder.log",
    benchmark:
        "results/benchmarks/ladder.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1500,
        runtime=15,
    params:
        code=code("ladder"),
        steps=config["scenes"]["fit_steps"],
        size=config["render"]["grid_size"],
        samples=config["render"]["grid_samples"],
        seed=config["seed"],
    script:
        "../scripts/ladder.py"
