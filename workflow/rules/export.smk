# A folder per format and material, with the material's file or files inside: results/export/merl/chrome holds
# chrome.binary. A material is a name of the manifest, or sample-<number> of the diffusion model's samples.
rule export:
    input:
        lambda wildcards: exported_store(wildcards.material),
    output:
        directory("results/export/{format}/{material}"),
    log:
        "results/logs/export/{format}/{material}.log",
    benchmark:
        "results/benchmarks/export/{format}/{material}.tsv"
    wildcard_constraints:
        format="|".join(FORMATS),
        material="[^/]+",
    conda:
        "../envs/neumat.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("export"),
    script:
        "../scripts/export.py"
