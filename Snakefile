"""From measured materials to synthesised ones. The targets; the rules are in workflow/rules/."""

from snakemake.utils import min_version

min_version("9.0")


configfile: f"{workflow.basedir}/config/config.yaml"


report: "workflow/report/workflow.rst"


include: "workflow/rules/common.smk"
include: "workflow/rules/sources.smk"
include: "workflow/rules/augment.smk"
include: "workflow/rules/fit.smk"
include: "workflow/rules/dense.smk"
include: "workflow/rules/generative.smk"
include: "workflow/rules/evaluate.smk"
include: "workflow/rules/coverage.smk"
include: "workflow/rules/render.smk"
include: "workflow/rules/conditional.smk"
include: "workflow/rules/constrained.smk"
include: "workflow/rules/packaged.smk"
include: "workflow/rules/scenes.smk"
include: "workflow/rules/stability.smk"
include: "workflow/rules/export.smk"
include: "workflow/rules/btf.smk"
include: "workflow/rules/charts.smk"
include: "workflow/rules/run.smk"


rule all:
    default_target: True
    input:
        lambda wildcards: targets("all"),
        "results/tables/run.csv",


rule charts:
    input:
        TARGETS["charts"],
        "results/tables/run-charts.csv",


rule generalisation:
    input:
        TARGETS["generalisation"],
        "results/tables/run-generalisation.csv",


rule btf:
    input:
        TARGETS["btf"],
        "results/tables/run-btf.csv",


rule btf_all:
    input:
        TARGETS["btf_all"],
        "results/tables/run-btf_all.csv",


rule packaged:
    input:
        TARGETS["packaged"],


# Every rule of the targets, and one export in each format; meant for config/smoke.yaml.
rule smoke:
    input:
        rules.all.input,
        rules.charts.input,
        rules.generalisation.input,
        rules.btf.input,
        rules.btf_all.input,
        TARGETS["packaged"],
        TARGETS["export"],
        expand("results/scenes/preview/{scene}.png", scene=config["scenes"]["names"]),
