"""Write the packaged model in half precision, and its data card."""

from pathlib import Path

from neumat.conditions.packaged import write_packaged
from neumat.files import atomic_path
from neumat.generative.conditional import ConditionalDiffusion
from neumat.reporting.model_card import model_card
from neumat.stage import stage
from neumat.tables import read_table

with stage(snakemake):
    store, params, output = snakemake.input, snakemake.params, snakemake.output
    model = ConditionalDiffusion.load(store.model)
    write_packaged(output.model, model)
    facts = {
        "size": Path(output.model).stat().st_size / 1e6,
        "sources": params.sources,
        "blends": params.blends,
        "dense": params.dense,
        "mixing": model.base.mixing,
        "coordinates": len(model.base.state["coordinates.back"]),
        "steps": model.base.steps,
        "tuning": model.tuning.steps,
    }
    card = model_card(facts, read_table(store.coverage), read_table(store.conditional))
    with atomic_path(output.card) as temporary:
        temporary.write_text(card, encoding="utf-8")
