# SPDX-License-Identifier: MIT
import pytest

from vtgtsam.exceptions import HandError, MeshError
from vtgtsam.input.door import reading


def test_what_a_parser_raises_is_a_sentence_that_names_the_data():
    with pytest.raises(HandError, match="^hand.xml cannot be used: KeyError: 'body'") as error:
        with reading("hand.xml", HandError):
            {}["body"]
    assert isinstance(error.value.__cause__, KeyError)


def test_a_message_of_a_parser_cannot_fill_the_screen():
    with pytest.raises(HandError) as error, reading("hand.xml", HandError):
        raise ValueError("x\n" * 10_000)
    assert len(str(error.value)) < 400


def test_our_own_errors_and_those_of_the_system_pass():
    with pytest.raises(MeshError, match="^no triangles$"), reading("hand.xml", HandError):
        raise MeshError("no triangles")
    with pytest.raises(FileNotFoundError), reading("hand.xml", HandError):
        open("/nowhere/at/all")


@pytest.mark.parametrize(
    ("raised", "words"), [(MemoryError, "more memory"), (RecursionError, "nested too deeply")]
)
def test_too_much_of_it_is_said_in_words(raised, words):
    with pytest.raises(HandError, match=f"^hand.xml .*{words}"), reading("hand.xml", HandError):
        raise raised
