"""What a text says, told by its words."""

import pytest

from neumat.metrics.words import says


@pytest.mark.parametrize(
    ("text", "word", "expected"),
    [
        ("Green metal", "green", True),
        ("Green metal", "metallic", True),
        ("a grey object", "gray", True),
        ("dark varnished walnut", "brown", False),
        ("shiny black car paint", "glossy", True),
        ("evergreen", "green", False),
    ],
)
def test_a_text_says_a_word_or_its_synonym(text, word, expected):
    assert says(text, word) == expected
