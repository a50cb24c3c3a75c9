CONDITIONAL = "results/conditional/model.safetensors"
CONDITIONS = "results/conditional/conditions.h5"


# Types, captions and pictures of every material, encoded.
rule conditions:
    input:
        neumerl=NEUMERL,
        manifest=MANIFEST,
    output:
        CONDITIONS,
    log:
        "results/logs/conditions.log",
    benchmark:
        "results/benchmarks/conditions.tsv"
    priority: 1
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=6000,
        runtime=15,
    params:
        code=code("conditions"),
        types=contents("config/types.tsv"),
        prompts=contents("config/prompts.tsv"),
        things=contents("config/things.tsv"),
        config={
            key: config["conditional"][key]
            for key in ("encoder", "captions", "pictures", "lightings")
        },
        seed=config["seed"],
    script:
        "../scripts/conditions.py"


rule projection:
    input:
        conditions=CONDITIONS,
        manifest=MANIFEST,
    output:
        "results/conditional/projection{power,|@.+}.safetensors",
    log:
        "results/logs/projection{power}.log",
    benchmark:
        "results/benchmarks/projection{power}.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1500,
        runtime=10,
    params:
        code=code("projection"),
        protocol="grouped",
        projection=lambda wildcards: projection_of(wildcards.power),
        seed=config["seed"],
    script:
        "../scripts/projection.py"


rule tune:
    input:
        neumerl=NEUMERL,
        manifest=MANIFEST,
        conditions=CONDITIONS,
        statistics="results/categories/statistics.csv",
        projection="results/conditional/projection{power}.safetensors",
        model="results/models/grouped/hyperdiffusion.safetensors",
    output:
        "results/conditional/model{power,|@.+}.safetensors",
    log:
        "results/logs/tune{power}.log",
    benchmark:
        "results/benchmarks/tune{power}.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1500,
        runtime=45,
    params:
        code=code("tune"),
        protocol="grouped",
        tuning=config["conditional"]["tuning"],
        rules=config["constrained"]["rules"],
        sampling=config["conditional"]["sampling"],
        served={key: config["conditional"][key] for key in ("guidance", "candidates")},
        things=contents("config/things.tsv"),
        seed=config["seed"],
        checkpoint="results/conditional/model{power}.checkpoint",
    script:
        "../scripts/tune.py"


rule conditional:
    input:
        **({"dense": DENSE} if DENSE_BASES else {}),
        model=CONDITIONAL,
        neumerl=NEUMERL,
        manifest=MANIFEST,
        sources=SOURCES_STORE,
        conditions=CONDITIONS,
        measured=PICTURED,
    output:
        table=report(
            "results/tables/conditional.csv",
            caption="../report/conditional.rst",
            category="Conditional",
        ),
        types=report(
            "results/tables/conditional_types.csv",
            caption="../report/conditional_types.rst",
            category="Conditional",
        ),
        samples="results/samples/conditional.h5",
        type=report(
            "results/figures/by-type.png",
            caption="../report/by_request.rst",
            category="Conditional",
        ),
        text=report(
            "results/figures/by-text.png",
            caption="../report/by_request.rst",
            category="Conditional",
        ),
        image=report(
            "results/figures/by-image.png",
            caption="../report/by_request.rst",
            category="Conditional",
        ),
    log:
        "results/logs/conditional.log",
    benchmark:
        "results/benchmarks/conditional.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=2500,
        runtime=45,
    params:
        code=code("conditional"),
        types_of_materials=contents("config/types.tsv"),
        prompts=contents("config/prompts.tsv"),
        config={
            key: config["conditional"][key]
            for key in ("samples", "guidance", "candidates", "images")
        },
        size=config["render"]["grid_size"],
        spp=config["render"]["grid_samples"],
        sampling_seed=config["generative"]["sampling"]["seed"],
        seed=config["seed"],
    script:
        "../scripts/conditional.py"


rule chart_guidance:
    input:
        model=CONDITIONAL,
        neumerl=NEUMERL,
        manifest=MANIFEST,
        sources=SOURCES_STORE,
        conditions=CONDITIONS,
    output:
        table="results/charts/guidance.csv",
        chart=report(
            "results/charts/guidance.png",
            caption="../report/chart_guidance.rst",
            category="Charts",
        ),
        vector="results/charts/guidance.svg",
    log:
        "results/logs/chart_guidance.log",
    benchmark:
        "results/benchmarks/chart_guidance.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        code=code("chart_guidance"),
        types_of_materials=contents("config/types.tsv"),
        prompts=contents("config/prompts.tsv"),
        config={
            key: config["conditional"][key]
            for key in ("samples", "guidance", "guidances", "images")
        },
        sampling_seed=config["generative"]["sampling"]["seed"],
        seed=config["seed"],
    script:
        "../scripts/chart_guidance.py"


rule text_ablation:
    input:
        models=[conditional_model(power) for power in config["charts"]["text_powers"]],
        neumerl=NEUMERL,
        manifest=MANIFEST,
        sources=SOURCES_STORE,
        conditions=CONDITIONS,
    output:
        report(
            "results/tables/text_ablation.csv",
            caption="../report/text_ablation.rst",
            category="Conditional",
        ),
    log:
        "results/logs/text_ablation.log",
    benchmark:
        "results/benchmarks/text_ablation.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        code=code("text_ablation"),
        types_of_materials=contents("config/types.tsv"),
        prompts=contents("config/prompts.tsv"),
        powers=config["charts"]["text_powers"],
        samples=config["conditional"]["samples"],
        guidance=config["conditional"]["guidance"]["text"],
        sampling_seed=config["generative"]["sampling"]["seed"],
        seed=config["seed"],
    script:
        "../scripts/text_ablation.py"


rule things:
    input:
        model=CONDITIONAL,
        neumerl=NEUMERL,
        manifest=MANIFEST,
        sources=SOURCES_STORE,
        conditions=CONDITIONS,
    output:
        report(
            "results/tables/things.csv",
            caption="../report/things.rst",
            category="Conditional",
        ),
    log:
        "results/logs/things.log",
    benchmark:
        "results/benchmarks/things.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=2500,
        runtime=20,
    params:
        code=code("things"),
        types_of_materials=contents("config/types.tsv"),
        prompts=contents("config/prompts.tsv"),
        things=contents("config/things.tsv"),
        config={
            key: config["conditional"][key]
            for key in ("samples", "guidance", "candidates")
        },
        sampling_seed=config["generative"]["sampling"]["seed"],
        seed=config["seed"],
    script:
        "../scripts/things.py"
