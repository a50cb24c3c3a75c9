"""Captions of materials: truthful descriptions in many wordings, for the text condition.

M3ashy (section 4.4) takes the description from the material's name, drops colour words of permuted materials and
calls a blend "a mixture of A and B". Here the colour and the gloss of every material, permuted or not, are named from
what its BRDF looks like (`neumat.metrics.words`), so that captions are true and tell colours apart.
"""

from neumat.seeds import numpy_generator

# How else one says the words of `neumat.metrics.words`.
COLOURS = {
    "red": ("red",),
    "orange": ("orange",),
    "yellow": ("yellow",),
    "green": ("green",),
    "turquoise": ("turquoise", "cyan", "teal"),
    "blue": ("blue",),
    "purple": ("purple", "violet"),
    "pink": ("pink", "rose"),
    "brown": ("brown",),
    "beige": ("beige", "light brown"),
    "white": ("white",),
    "gray": ("gray", "grey"),
    "black": ("black",),
    "gold": ("gold", "golden"),
    "silver": ("silver", "silvery gray"),
}
GLOSS = {
    "matte": ("matte", "dull", "flat", "rough", "non-reflective"),
    "satin": ("satin", "semi-gloss", "soft-sheen"),
    "glossy": ("glossy", "shiny", "specular", "smooth"),
    "mirror": ("mirror-like", "highly polished", "very shiny", "highly specular", "reflective"),
}
# Objects of no particular material, and how else one says a colour: a request is not worded as a catalogue is.
OBJECTS = ("vase", "chair", "ball", "box", "lamp", "toy", "bottle", "door", "shoe", "table", "wall", "helmet", "phone")
SHADES = ("bright", "deep", "vivid", "pure", "strong", "plain")
FINISHES = {"metal": ("metallic",), "fabric": ("textile", "cloth"), "wood": ("wooden",), "stone": ("mineral",)}
# What a caption is made of; each wording leaves something out, as people do.
WORDINGS = (
    "{colour} {thing}",
    "{gloss} {colour} {thing}",
    "a {gloss} {thing} in {colour}",
    "{thing}, {colour} and {gloss}",
    "{gloss} {thing}",
    "{thing}",
    "a material of {colour} {thing}",
    "{colour} {family}",
    "a {colour} {finish} {object}",
    "{gloss} {colour} {family}",
    "{gloss} {family}",
    "{finish}",
    "{family}, {colour}",
    "{colour}",
    "{shade} {colour}",
    "{colour} material",
    "something {gloss}",
    "a {colour} {object}",
    "{gloss} {colour} {object}",
    "a {gloss} {object}",
    "a {colour} thing with a {gloss} finish",
    "{gloss} {colour} surface",
    "{gloss}",
    "{gloss} material",
    "a photo of {colour} {thing}",
)


# What a caption calls a material that looks like a thing; so many of all captions do, where it looks like any.
LIKENESSES = (
    "{likeness}",
    "{gloss} {likeness}",
    "{colour} {likeness}",
    "something like {likeness}",
    "looks like {likeness}",
)
LIKENED = 0.25


def captions(facts, count, unseen, seed, likenesses=None):
    """Return a list of `count` captions for each row of `facts`, drawn by `seed` and the row's name.

    facts: DataFrame with the columns name, colour (a key of COLOURS), gloss (a key of GLOSS), thing (the description
    without colour), family (empty where unknown). unseen: prompts that test what was not trained on: no caption is one
    of them, nor contains one of several words.
    """
    unseen = [prompt.strip().lower() for prompt in unseen]
    likenesses = [()] * len(facts) if likenesses is None else likenesses
    return [
        _of_one(row, likeness, count, unseen, numpy_generator(seed, "captions", row.name))
        for row, likeness in zip(facts.itertuples(), likenesses, strict=True)
    ]


def thing_of(material, types):
    """Return (thing, family) of a row of the manifest: the description of its source, or of both parents' mixture.

    types: see `brdf.types.read_types`; a source that it does not name is called by its own name.
    """
    parents = [material.parent_a, material.parent_b]
    things = [types["description"].get(name, name.replace("-", " ").replace("_", " ")) for name in parents]
    families = [types["family"].get(name, "") for name in parents]
    if parents[0] == parents[1]:
        return things[0], families[0]
    family = families[0] if families[0] == families[1] else ""
    return f"mixture of {things[0]} and {things[1]}", family


def _of_one(row, likenesses, count, unseen, generator):
    made = []
    usable = [w for w in WORDINGS if row.family or not ("{family}" in w or "{finish}" in w)]
    while len(made) < count:
        likened = len(likenesses) and generator.random() < LIKENED
        wordings = LIKENESSES if likened else usable
        wording = wordings[generator.integers(len(wordings))]
        text = wording.format(
            likeness=generator.choice(likenesses) if likened else "",
            colour=generator.choice(COLOURS[row.colour]),
            gloss=generator.choice(GLOSS[row.gloss]),
            thing=row.thing,
            family=row.family,
            finish=generator.choice(FINISHES.get(row.family, (row.family,))),
            object=generator.choice(OBJECTS),
            shade=generator.choice(SHADES),
        )
        lower = text.lower()  # what a user calls a source may have capitals
        if not any(lower == prompt or (" " in prompt and prompt in lower) for prompt in unseen):
            made.append(text)
    return made
