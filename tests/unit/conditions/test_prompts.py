from pathlib import Path

import pandas as pd
import pytest

from neumat.conditions.prompts import read_prompts
from neumat.errors import NeumatError

CONFIG = Path(__file__).parents[3] / "config"
HEADER = "prompt\tcolour\tgloss\tfamily\n"


def test_the_prompts_are_whole_and_unseen():
    types = pd.read_csv(CONFIG / "types.tsv", sep="\t")
    table = read_prompts(CONFIG / "prompts.tsv", set(types["family"]))
    assert len(table) >= 33 and {"green metal", "red plastic", "highly specular material"} <= set(table["prompt"])
    assert (table[["colour", "gloss", "family"]] != "").any(axis=1).all()
    assert not set(table["prompt"]) & set(types["description"])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "expected a table of prompts .*; found no such file"),
        ("", "expected a table of prompts"),
        ("prompt\tcolour\nred\tred\n", "expected the columns prompt, colour, gloss, family; found"),
        (HEADER, "expected different prompts, at least one; found none"),
        (HEADER + "mirror\t\t\t\n" * 2, "expected different prompts, at least one; found 'mirror'"),
        (HEADER + "a\t\t\t\n\tred\t\t\n", "line 3: expected a prompt; found none"),
        (HEADER + "a\treddish\t\t\n", "line 2: expected as colour one of red, .*; found 'reddish'"),
        (HEADER + "a\t\tsticky\t\n", "line 2: expected as gloss one of matte, .*; found 'sticky'"),
        (HEADER + "a\t\t\tglass\n", "line 2: expected as family one of metal; found 'glass'"),
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
