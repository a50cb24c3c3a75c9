from pathlib import Path

import pandas as pd
import pytest

from neumat.conditions.prompts import EARLIER, REPORT, VALIDATION, read_prompts
from neumat.errors import NeumatError
from neumat.metrics.words import COLOURS, GLOSS

CONFIG = Path(__file__).parents[3] / "config"
HEADER = "prompt\tcolour\tgloss\tfamily\tuse\n"


def test_the_prompts_are_whole_and_unseen():
    types = pd.read_csv(CONFIG / "types.tsv", sep="\t")
    table = read_prompts(CONFIG / "prompts.tsv", set(types["family"]))
    earlier = set(table["prompt"][table["use"] == EARLIER])
    assert len(earlier) == 36 and {"green metal", "red plastic", "highly specular material"} <= earlier
    assert (table[["colour", "gloss", "family"]] != "").any(axis=1).all()
    assert not set(table["prompt"]) & set(types["description"])


@pytest.mark.parametrize("use", [VALIDATION, REPORT])
def test_each_side_of_the_prompts_spreads_over_colours_glosses_and_families(use):
    types = pd.read_csv(CONFIG / "types.tsv", sep="\t")
    table = read_prompts(CONFIG / "prompts.tsv", set(types["family"]))
    own = table[table["use"] == use]
    assert len(own) >= 12 and set(own["family"]) >= set(types["family"])
    assert len(set(own["colour"]) & set(COLOURS)) >= 10 and set(own["gloss"]) >= {*GLOSS, "metallic"}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "expected a table of prompts .*; found no such file"),
        ("", "expected a table of prompts"),
        ("prompt\tcolour\nred\tred\n", "expected the columns prompt, colour, gloss, family, use; found"),
        (HEADER, "expected different prompts, at least one; found none"),
        (HEADER + "mirror\t\t\t\treport\n" * 2, "expected different prompts, at least one; found 'mirror'"),
        (HEADER + "mirror\t\t\t\treport\nMirror \t\t\t\tvalidation\n", "found 'Mirror '"),
        (HEADER + "a\t\t\t\treport\n", "expected prompts for validation and for report; found none for validation"),
        (HEADER + "a\t\t\t\tearlier\n", "found none for report and validation"),
        (HEADER + "a\t\t\t\ttraining\n", "line 2: expected as use one of validation, earlier, report; found 'tra"),
        (HEADER + "a\t\t\t\n", "line 2: expected as use one of validation, earlier, report; found ''"),
        (HEADER + "a\t\t\t\treport\n\tred\t\t\treport\n", "line 3: expected a prompt; found none"),
        (HEADER + "a\treddish\t\t\treport\n", "line 2: expected as colour one of red, .*; found 'reddish'"),
        (HEADER + "a\t\tsticky\t\treport\n", "line 2: expected as gloss one of matte, .*; found 'sticky'"),
        (HEADER + "a\t\t\tglass\treport\n", "line 2: expected as family one of metal; found 'glass'"),
        (HEADER + "a\t\t\t\t\t\n\t\n" + "a\tb\tc\td\te\tf\tg\th\n", "expected"),
    ],
)
def test_bad_prompts_end_in_one_line(tmp_path, text, message):
    path = tmp_path / "prompts.tsv"
    if text is not None:
        path.write_text(text)
    with pytest.raises(NeumatError, match=message) as caught:
        read_prompts(path, ["metal"])
    assert "prompts.tsv" in str(caught.value) and "\n" not in str(caught.value)
