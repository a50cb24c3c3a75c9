"""The sections of docs/results.md: what each shows, from which files, and how it is to be read."""

import functools
from dataclasses import dataclass, field

from neumat.reporting.coverage import verdict
from neumat.reporting.tables import table2_markdown
from neumat.tables import read_table

_DISTANCES = ["brdf_l1", "rmse", "neg_psnr", "neg_ssim"]  # the paper's
_BY_MITSUBA = "rendered with Mitsuba 3"


@dataclass(frozen=True)
class Section:
    """One section of the page.

    needs: files of the run, without which the section only says what makes them (`make`). tables: functions of the
    folder of results that return a data frame, Markdown, or None. pictures: {file of the run: caption}.
    """

    title: str
    text: str
    needs: tuple = ()
    make: str = "`make`"
    tables: tuple = ()
    pictures: dict = field(default_factory=dict)


def _rows(results, name, columns=(), drop=(), **keep):
    """Return a table of the run: `columns` of those that it has (all where none is named), rows that match `keep`.

    None where the run has no such table.
    """
    if not (results / name).is_file():
        return None
    table = read_table(results / name)
    for key, value in keep.items():
        table = table[table[key] == value]
    columns = [name for name in columns if name in table] or list(table)
    return table[[name for name in columns if name not in drop]]


def show(name, *columns, **options):
    """Return a function of the folder of results that returns the table `name` of the run, as `_rows` does."""
    return functools.partial(_rows, name=name, columns=columns, **options)


def _table2(results, name, protocol):
    """Return 1-NNA and COV under one protocol by the paper's distances, as Markdown."""
    table = read_table(results / name)
    table = table[(table["protocol"] == protocol) & table["distance"].isin(_DISTANCES)]
    text = table2_markdown(table[table["metric"].isin(["one_nna", "cov"])])
    return text.replace(f"## {protocol}\n", "").strip()


def _coverage(results, name):
    """Return the rows of a table of coverage at its largest number of samples, intervals beside their values."""
    table = read_table(results / name)
    table = table[table["size"].isna() | (table["size"] == table["size"].max())]
    return table.drop(columns=["size", "frontier", "null", "behind", "behind_low", "behind_high"])


def _verdict(results):
    """Return the sentence on the frontier of nulls, as Markdown."""
    return verdict(read_table(results / "tables/coverage.csv"))


def _requests(results):
    """Return a row for each modality, use and measure, and a column for each method."""
    table = read_table(results / "tables/conditional.csv")
    return table.pivot_table("value", ["modality", "use", "measure"], "method", sort=False).reset_index()


def _stages(results):
    """Return CPU minutes and the largest peak of memory of every stage of the run, the longest first."""
    run = read_table(results / "tables/run.csv")
    run = run[(run["stage"] != "run") & (run["job"] != "total")]
    stages = run.groupby("stage").agg(jobs=("job", "size"), minutes=("cpu_s", "sum"), peak_mib=("peak_mib", "max"))
    stages["minutes"] /= 60
    return stages.sort_values("minutes", ascending=False).reset_index()


SECTIONS = (
    Section(
        "New materials",
        "Samples against sources that no training material descends from, at equal numbers of samples, in the mean of "
        "folds that no setting was chosen on. `coverage`: distance of an unseen source to the nearest sample, the "
        "mean; `of_copies`: relative to that of copies, the null that draws nothing new. `precision`: distance of a "
        "sample to the nearest source, seen or not, the median; the line `held-out` has that of sources among one "
        "another. `novelty`: distance of a sample to the nearest training source, the median; `any tint`: after the "
        "best gain of each channel; `bases`: to blends too; the line `held-out` has that of unseen sources. Distances "
        "are BRDF-L1-log, whatever the order of the channels. Nulls need no model: each is a row for every `level`. "
        "The last table is the denoiser's mean squared error, in units of the data's variance.",
        ("tables/coverage.csv",),
        tables=(
            _verdict,
            functools.partial(_coverage, name="tables/coverage.csv"),
            show("tables/memorisation.csv"),
        ),
        pictures={
            "charts/coverage.png": "Coverage of unseen materials against precision, the default model and nulls",
            "figures/nearest.png": "Samples (left) beside their nearest training materials (right), whatever the order "
            "of their channels, unpicked",
        },
    ),
    Section(
        "Materials sampled by the diffusion model",
        "The first samples of the run, in the order in which they were drawn.",
        ("figures/grid.png",),
        pictures={"figures/grid.png": f"The first samples; {_BY_MITSUBA}"},
    ),
    Section(
        "Every method side by side",
        "The first 16 samples of every method, below held-out materials. Copies are training materials and look as "
        "good as any; the table of coverage tells them apart.",
        ("figures/methods.png",),
        pictures={"figures/methods.png": "The first samples of every method"},
    ),
    Section(
        "Augmentation",
        "The six orders of a material's channels, and a blend of two materials: above in PCA space, as AugMERL holds "
        "it, below in the space of BRDF values.",
        ("tables/augmentation.csv",),
        tables=(show("tables/augmentation.csv"),),
        pictures={
            "figures/permutations.png": "Six permutations of one material",
            "figures/blends.png": "A blend of two materials in PCA space and in BRDF space",
        },
    ),
    Section(
        "Fits",
        "Fields of 675 weights against the tables that they were fitted to. `loss` is the held-out loss over the "
        "grid's entries, which are dense in the highlight, or over uniform angles; `psnr` (dB) and `ssim` are those "
        "of rendered spheres. The embedded materials (`fitted`) are themselves fields, of another architecture, and "
        "easier to fit than measurements. Settings were chosen on `measured, validation`; no setting was chosen on "
        "`measured, reporting`. `loss_published` is the loss of the published field of the same measured materials. "
        "`not measured`: the run named no folder in `fit.measured`.",
        ("tables/fit-summary.csv",),
        tables=(show("tables/fit-summary.csv"),),
    ),
    Section(
        "Fields in programs that do not fold phi_d",
        "How far the brightness of a field is off where d_y < 0, as a share of the folded brightness: of fitted and "
        "sampled fields and of answers to requests. Zero is ideal.",
        ("tables/unfolded.csv",),
        tables=(show("tables/unfolded.csv"),),
    ),
    Section(
        "Unconditional synthesis, `parity`",
        "Held-out materials of a random split, as in the released code of M3ashy. Relatives of every held-out "
        "material are among the training materials, so copies of training data score as well as the model: they are "
        "the null, the training set the ceiling. The default model is made for new materials and so scores worse here "
        "than copying does: what it adds to the training set counts against it.",
        ("tables/unconditional.csv",),
        tables=(functools.partial(_table2, name="tables/unconditional.csv", protocol="parity"),),
    ),
    Section(
        "Unconditional synthesis, held-out sources",
        "Five folds: all that descends from a source is on one side. The row of the training set says how far even "
        "true data are told apart; copies are the null. No setting was chosen by these figures.",
        ("tables/generalisation.csv",),
        "`make generalisation`",
        tables=(
            functools.partial(_table2, name="tables/generalisation.csv", protocol="generalisation"),
            functools.partial(_coverage, name="tables/generalisation_coverage.csv"),
        ),
    ),
    Section(
        "Requests",
        "How well answers meet requests, by judges that share nothing with the encoders or the model but the "
        "definitions of words for colour and gloss. The nulls look known materials up, by the very score that chooses "
        "what is served: the training materials, these in the wanted colours with as many candidates as the model has, "
        "and the dense set. `null: unconditional` ignores the request; `training set` are training materials that are "
        "what was asked for, the ceiling. Distances are BRDF-L1-log, RMSE that of pictures. `use`: no setting was "
        "chosen on texts and pictures marked `report`; on prompts marked `earlier` settings were chosen, so read them "
        "as an upper bound. The types are all there are: settings were chosen on the same ones.",
        ("tables/conditional.csv",),
        tables=(_requests,),
        pictures={
            "figures/by-text.png": f"Materials from prompts that no training text holds; {_BY_MITSUBA}",
            "figures/by-image.png": f"Materials from pictures (left) of held-out materials; {_BY_MITSUBA}",
            "figures/by-type.png": f"Materials by type; {_BY_MITSUBA}",
            "charts/guidance.png": "Requests for validation against the guidance scale: how well they are met, "
            "diversity, invalid draws",
        },
    ),
    Section(
        "Things",
        "How often answers to the name of a thing lie within its ranges of colour and gloss in config/things.tsv. One "
        "thing in three is held out from captions and from the choice of answers.",
        ("tables/things.csv",),
        tables=(show("tables/things.csv"),),
    ),
    Section(
        "Categories",
        "Materials of one category of reflectance, by rejection from the unconditional model (the null) and by the "
        "model asked for the category. `training_share` is the share of training materials in the category; "
        "`one_nna` (50 is best) compares what was found with these.",
        ("tables/constrained.csv",),
        tables=(
            show(
                "tables/constrained.csv",
                *("category", "way", "found", "tried", "acceptance"),
                *("seconds_per_accepted", "training_share", "one_nna"),
            ),
        ),
        pictures={
            "figures/by-category.png": f"Materials of each category, by rejection; {_BY_MITSUBA}",
            "charts/constrained.png": "Seconds that a material of each category costs, by rejection and by request",
        },
    ),
    Section(
        "Scenes",
        "Sampled and measured materials on procedural shapes. Materials are named by the rank of their highlight.",
        ("scenes/terrace.png",),
        pictures={
            f"scenes/{name}.png": f"The scene {name}; {_BY_MITSUBA}"
            for name in ("terrace", "studio", "mirror", "shelf")
        },
    ),
    Section(
        "Speed and accuracy of fits",
        "Materials fitted with several budgets, with the default, and by M3ashy's schedule. `seconds` of CPU time for "
        "each material include its share of the first field (`first_seconds`), which all materials of a run start "
        "from. The published loop fits one material at a time, and its rate was measured in the same run: "
        "`rate_ratio` compares samples per second; `speedup_m3ashy` and `speedup_nbrdf` compare the time of a "
        "material, for the samples that the released programs visit (`charts.published_samples`). Measured materials "
        "are those of the folder `fit.measured`: budgets are chosen on the ones for validation, the others report.",
        ("charts/fit.csv",),
        "`make charts`",
        tables=(show("charts/fit.csv"),),
        pictures={
            "charts/fit-psnr.png": "Rendered PSNR of the fits against the seconds that one material takes",
            "charts/fit.png": "Held-out loss of the fits against the seconds that one material takes",
        },
    ),
    Section(
        "Fits of the dense set",
        "CPU seconds of a base and held-out loss: fitted as the paper's bases are, from the first field, and from the "
        "interpolation of the parents' fields. `fit.dense` was chosen on the bases for validation, the others report. "
        "`alignment_error` is the share of the fields' variance that 256 principal axes of the paper's bases leave.",
        ("tables/dense.csv",),
        "`make charts`",
        tables=(show("tables/dense.csv"),),
    ),
    Section(
        "Speed and accuracy of samples",
        "1-NNA by BRDF-L1 against the seconds of sampling and of training. Few draws stand behind each point: "
        "differences of one point of 1-NNA are not significant.",
        ("charts/sampling.csv",),
        "`make charts`",
        pictures={
            "charts/sampling.png": "1-NNA of the samples against the seconds of sampling",
            "charts/training.png": "1-NNA of the samples against the seconds of training",
        },
    ),
    Section(
        "Speed and accuracy of rendering",
        "PSNR of pictures against their time, for each way of drawing directions.",
        ("charts/bsdf.csv",),
        "`make charts`",
        pictures={"charts/bsdf.png": "PSNR of pictures against their time, by how directions are drawn"},
    ),
    Section(
        "Models that scenes need",
        "The cheapest models that keep every object of a scene within a tolerance (mean FLIP), as shares of 675 "
        "weights everywhere, the null. `kept` counts the materials that need all of their weights. `predicted` and "
        "`measured` compare the worst object with the materials' tables (sampled ones: their fields), on fresh random "
        "numbers; `noise` is what other random numbers show, `fit_error` what the fields themselves miss. "
        "`below_fit_error` and `exceeds` count the objects whose fields miss the tolerance and those that exceed it.",
        ("charts/models.csv",),
        "`make charts`",
        tables=(show("charts/models.csv"),),
        pictures={"charts/models.png": "Cost of a scene's models against the error that it may show"},
    ),
    Section(
        "The ladder of models",
        "Models of four measured materials over all angles: bytes, nanoseconds of a query, CPU seconds of the fit, the "
        "share of reflected light that is wrong, and the PSNR (dB) of a sphere. `lambert` is the null, `table` the "
        "ceiling.",
        ("tables/ladder.csv",),
        "`make charts`",
        tables=(show("tables/ladder.csv"),),
    ),
    Section(
        "Cost of the run",
        "CPU minutes and the largest job's memory of every stage of `all`.",
        ("tables/run.csv",),
        tables=(_stages,),
    ),
)
