rule chart_fit:
    input:
        measured=MEASURED,
        augmerl=STORE,
        sources=SOURCES_STORE,
    output:
        table="results/charts/fit.csv",
        loss=report(
            "results/charts/fit.png",
            caption="../report/chart_fit.rst",
            category="Charts",
        ),
        psnr=report(
            "results/charts/fit-psnr.png",
            caption="../report/chart_fit.rst",
            category="Charts",
        ),
        vector=multiext("results/charts/fit", ".svg", "-psnr.svg"),
    log:
        "results/logs/chart_fit.log",
    benchmark:
        "results/benchmarks/chart_fit.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=4500,
        runtime=180,
    params:
        code=code("chart_fit"),
        fit=section("fit", "materials_per_job", "independent", "measured", "dense"),
        published=config["charts"]["published_samples"],
        materials=config["charts"]["fit_materials"],
        size=config["render"]["size"],
        seed=config["seed"],
    script:
        "../scripts/chart_fit.py"


rule chart_sampling:
    input:
        neumerl=NEUMERL,
        manifest=MANIFEST,
        sources=SOURCES_STORE,
    output:
        table="results/charts/sampling.csv",
        sampling_one_nna=report(
            "results/charts/sampling.png",
            caption="../report/chart_sampling.rst",
            category="Charts",
        ),
        sampling_mmd=report(
            "results/charts/sampling-mmd.png",
            caption="../report/chart_sampling.rst",
            category="Charts",
        ),
        training_one_nna=report(
            "results/charts/training.png",
            caption="../report/chart_sampling.rst",
            category="Charts",
        ),
        training_mmd=report(
            "results/charts/training-mmd.png",
            caption="../report/chart_sampling.rst",
            category="Charts",
        ),
        vector=multiext(
            "results/charts/",
            "sampling.svg",
            "sampling-mmd.svg",
            "training.svg",
            "training-mmd.svg",
        ),
    log:
        "results/logs/chart_sampling.log",
    benchmark:
        "results/benchmarks/chart_sampling.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=2500,
        runtime=45,
    params:
        code=code("chart_sampling"),
        hyperparameters=hyperparameters_of("hyperdiffusion"),
        components=config["augment"]["components"],
        sampling=config["generative"]["sampling"],
        nfes=config["charts"]["sampling_nfes"],
        shares=config["charts"]["training_shares"],
        draws=config["charts"]["draws"],
        set_size=config["evaluate"]["set_size"],
        entries=config["evaluate"]["entries"],
        size=config["render"]["size"],
        seed=config["seed"],
    script:
        "../scripts/chart_sampling.py"


rule chart_bsdf:
    input:
        neumerl=NEUMERL,
        manifest=MANIFEST,
    output:
        table="results/charts/bsdf.csv",
        chart=report(
            "results/charts/bsdf.png",
            caption="../report/chart_bsdf.rst",
            category="Charts",
        ),
        vector="results/charts/bsdf.svg",
    log:
        "results/logs/chart_bsdf.log",
    benchmark:
        "results/benchmarks/chart_bsdf.tsv"
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1500,
        runtime=10,
    params:
        code=code("chart_bsdf"),
        samples=config["charts"]["bsdf_samples"],
    script:
        "../scripts/chart_bsdf.py"
