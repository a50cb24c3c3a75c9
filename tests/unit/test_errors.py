from neumat.errors import NeumatError


def test_the_message_is_one_line_whatever_was_found():
    error = NeumatError("a\nb.png", "an image", ValueError("first\r\nsecond"))
    assert str(error) == "a b.png: expected an image; found first second"
