"""Where synthesis on demand breaks: requests and settings at their limits, and which guard catches what.

Every stress says what must happen; what does happen stands beside it, measured on what was sampled.
"""

import copy
import tempfile
from pathlib import Path

import numpy as np
import torch

from neumat.conditions.packaged import halved
from neumat.conditions.photos import read_photo
from neumat.generative.conditional import ConditionalDiffusion
from neumat.generative.samplers import EVALUATIONS
from neumat.generative.training import device
from neumat.stability.odd_images import BLUE, BROKEN, RED, UNUSUAL, ball
from neumat.stability.request_bench import CANDIDATES, N
from neumat.stability.stress import ANEW, REFUSED, UNNEEDED, WARNED, Answer, Stress, refused, stress_table

SAMPLED = (UNNEEDED, ANEW, WARNED)  # that a colour is missed is told
CLOSE = 4  # mean difference of 8-bit values, below which two files show the same picture
ROUNDING = 0.01  # of bfloat16: mean |log(1 + f) - log(1 + f')|, far below what samples differ by
MANY, MEMORY = 256, 1000  # samples; MB
SAME = 1e-4  # of the order of sums in float32, in the same measure
SAMPLES = "valid samples"


def stability_table(bench, progress=iter):
    """Return the `stress_table` of a StressBench; guards may also be "drawn anew", what was no valid BRDF."""
    with tempfile.TemporaryDirectory() as folder:
        return stress_table(stresses(bench, Path(folder)), folder, progress)


def stresses(bench, folder):
    """Yield every Stress of a StressBench; images are written to `folder`, a Path."""
    yield from _settings(bench, folder)
    yield from _texts(bench)
    yield from _colours(bench)
    yield from _images(bench, folder)
    yield from _conditions(bench)
    yield from _numbers(bench)


def _settings(bench, folder):
    model = bench.synthesiser.model
    yield Stress("guidance -1", f"exactly the unconditional model; {SAMPLES}", SAMPLED, lambda: _unconditional(bench))
    for guidance in sorted({bench.guidance["text"], 2, 5, 10, 20}):
        yield Stress(f"guidance {guidance:g}", f"{SAMPLES} or one line", (*SAMPLED, REFUSED),
                     lambda guidance=guidance: bench.setting(guidance))  # fmt: skip
    for guidance in (-1.5, float("nan"), float("inf")):
        yield refused(f"guidance {guidance}", "a finite number of at least -1",
                       lambda guidance=guidance: bench.setting(guidance))  # fmt: skip
    for steps in (1, 2, 3, 4, 5):
        few = altered(model, nfe=steps * EVALUATIONS[model.base.sampler])
        yield Stress(f"sampling steps: {steps}", f"{SAMPLES} (of 2 steps at least) or one line",
                     (*SAMPLED, REFUSED), lambda few=few: bench.setting(model=few))  # fmt: skip
    halved = altered(model, integrate=lambda denoise, *rest: model.base.integrate(_halved(denoise), *rest))
    yield Stress("the same seed, half of the samples at a time", f"within {SAME} of all at once; {SAMPLES}", SAMPLED,
                 lambda: bench.setting(model=halved, within=SAME))  # fmt: skip
    low = altered(model, integrate=lambda denoise, *rest: model.base.integrate(_bfloat16(denoise), *rest))
    yield Stress("networks in bfloat16", f"within {ROUNDING} of float32; {SAMPLES}", SAMPLED,
                 lambda: bench.setting(model=low, within=ROUNDING))  # fmt: skip
    yield Stress("weights in float16", f"within {ROUNDING} of float32; {SAMPLES}", SAMPLED,
                 lambda: bench.setting(model=_packaged(model, folder), within=ROUNDING))  # fmt: skip


def _halved(denoise):
    """Return `denoise` that takes half of the samples at a time."""

    def halves(x, sigma, rows):
        middle = len(x) // 2
        cut = rows.start + middle
        return torch.cat([
            denoise(x[:middle], sigma, slice(rows.start, cut)), denoise(x[middle:], sigma, slice(cut, rows.stop)),
        ])  # fmt: skip

    return halves


def _unconditional(bench):
    model, answer = bench.synthesiser.model, bench.setting(-1)
    raw = model.draw(N, bench.seed, bench.synthesiser.request(text="red"), -1)
    same = torch.equal(raw, model.base.draw(N, bench.seed))
    return answer._replace(right=answer.right and same)


def altered(model, **attributes):
    """Return a ConditionalDiffusion like `model`, with other attributes of its base."""
    result, result.base = copy.copy(model), copy.copy(model.base)
    vars(result.base).update(attributes)
    return result


def _packaged(model, folder):
    """Return a ConditionalDiffusion as the package holds one: its weights were rounded to half precision."""
    halved(model).save(folder / "packaged.safetensors")
    return ConditionalDiffusion.load(folder / "packaged.safetensors")


def _bfloat16(denoise):
    def low(x, sigma, rows):
        with torch.autocast(device().type, torch.bfloat16):
            return denoise(x, sigma, rows).float()

    return low


def _texts(bench):
    for name, text, part in (
        ("empty", "", "an empty text"),
        ("blank", " \t\n ", "an empty text"),
        ("a number", 5, "words"),
        ("not Unicode", "caf\udce9", "Unicode"),
        ("letters that cannot be seen", "\u200b", "signs only"),
        ("pictographs", "✨🔴", "signs only"),
    ):
        yield refused(f"text: {name}", part, lambda text=text: bench.ask(text=text))
    for name, text in (
        ("German", "rotes Plastik"),
        ("French", "bois verni noir"),
        ("Spanish", "lana roja brillante"),
        ("Japanese", "赤いプラスチック"),
        ("random letters", "xqzv blorptang"),
        ("about something else", "how do I file my taxes"),
    ):
        yield refused(f"text: {name}", "of which nothing is known", lambda text=text: bench.ask(text=text))
    yield Stress("text: nonsense, forced", f"one line: unlike any description; {SAMPLES}", (WARNED,),
                 lambda: bench.ask(text="xqzv blorptang", force=True), "unlike any description")  # fmt: skip
    yield Stress("text: 10,000 letters without a space", f"{SAMPLES}; a cut is told", SAMPLED,
                 lambda: bench.ask(["red"], text="red " + "a" * 10_000))  # fmt: skip
    for name, text, part in (
        ("10,000 words", "a bright red plastic " * 2500, "word pieces are read"),
        ("contradictory colours", "red and blue plastic", "contradicts itself in colour"),
        ("contradictory gloss", "matte red mirror", "contradicts itself in gloss"),
        ("unknown sign", "red metal (银)", "银"),
        ("a negation without a known word", "red plastic, not too expensive", "may not be understood"),
    ):
        yield Stress(f"text: {name}", f"one line: {part}; {SAMPLES}", (WARNED,),
                     lambda text=text: bench.ask(["red"], text=text), part)  # fmt: skip


def _colours(bench):
    for name in ("blurgh", "#12345", ""):
        yield refused(f"colour: {name!r}", "#b87333", lambda name=name: bench.ask(colour=name))
    for name, number in (("pure blue", "#0000ff"), ("pure green", "#00ff00"), ("white", "#fff"), ("black", "#000")):
        yield Stress(f"colour: {name}, which no training material has", f"{SAMPLES}; what is missed is told", SAMPLED,
                     lambda number=number: bench.coloured(number))  # fmt: skip


def _images(bench, folder):
    def unusual(path, write, mode):
        write(path)
        plain = ball(RED).convert(mode).convert("RGB")
        off = np.abs(read_photo(path).numpy() - np.asarray(plain, float)).mean()
        answer = bench.ask(["red"], image=path)
        return Answer(f"{off:.1f} of 255 off, {answer.found}", answer.right and off < CLOSE, answer.guard)

    def broken(path, write):
        write(path)
        return bench.ask(image=path)

    for name, (file, write, mode) in UNUSUAL.items():
        yield Stress(f"image: {name}", f"read as the plain picture; {SAMPLES}", SAMPLED,
                     lambda path=folder / file, write=write, mode=mode: unusual(path, write, mode))  # fmt: skip
    for name, (file, write, part) in BROKEN.items():
        yield refused(f"image: {name}", part, lambda path=folder / file, write=write: broken(path, write))
    yield refused("image: floats in memory", "uint8", lambda: bench.ask(image=torch.rand(64, 64, 3)))


def _conditions(bench):
    red, blue = (torch.from_numpy(np.array(ball(colour))) for colour in (RED, BLUE))
    noise = torch.from_numpy(np.random.default_rng(0).integers(0, 256, (64, 64, 3), np.uint8))
    types = bench.synthesiser.types  # those of the sources: none may be known of the user's own
    every = {"type": "plastic"} if "plastic" in types else {}
    every |= {"category": "plastic", "text": "red plastic", "image": red}
    asked = f"{', '.join([*every][:-1])} and image"
    yield refused("unknown type", "one of" if types else "no type", lambda: bench.ask(type="wombat"))
    yield refused("unknown category", "one of", lambda: bench.ask(category="wombat"))
    for name, words, request in (
        ("nothing asked for", (), {}),
        ("image of noise", (), {"image": noise}),
        ("type felt, text mirror", ("matte", "mirror"), {"type": "felt", "text": "mirror"}),
        ("text red, image blue", ("red", "blue"), {"text": "red", "image": blue}),
        (f"{asked} that agree", ("red",), every),
        (f"{asked} that do not", ("red", "blue"), every | {"category": "mirror", "image": blue}),
    ):
        if request.get("type") in (None, *types):
            yield Stress(name, SAMPLES, SAMPLED, lambda words=words, request=request: bench.ask(words, **request))


def _numbers(bench):
    def scaled(factor):
        request = {"text": bench.synthesiser.request(text="red")["text"] * factor}
        return bench.answer(*bench.synthesiser.model.sample(N, bench.seed, request, bench.guidance["text"]))

    def counted(n):
        return bench.answer(*bench.synthesiser.synthesise(n, bench.seed, bench.guidance, CANDIDATES, text="red"))

    for factor in (float("nan"), float("inf")):
        yield refused(f"request row times {factor}", "finite numbers", lambda factor=factor: scaled(factor))
    yield Stress("request row times 1e6", f"{SAMPLES} or one line", (*SAMPLED, REFUSED), lambda: scaled(1e6))
    for n in (0, -1):
        yield refused(f"{n} samples", "at least 1 sample", lambda n=n: counted(n))
    yield Stress(f"{MANY} samples by one request", f"{SAMPLES}, none twice, within {MEMORY} MB more", SAMPLED,
                 lambda: bench.many(MANY, MEMORY))  # fmt: skip
    for name, seed in (("0", 0), ("-1", -1), ("2 ** 70", 2**70)):
        yield Stress(f"seed {name}", f"{SAMPLES}, twice the same", SAMPLED, lambda seed=seed: bench.repeated(seed))
