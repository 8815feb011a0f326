"""What a replay says in words."""

from scenarios.sip.replay import crushed_in_words, hooked_in_words


def test_a_lip_caught_between_neck_and_teeth_is_said_and_contact_as_usual_is_not():
    assert crushed_in_words(0.0042) == ""
    assert "0.63 mm into a lip" in crushed_in_words(0.634)


def test_a_lip_that_the_neck_takes_along_is_said():
    assert hooked_in_words(()) == ""
    assert "the upper lip still hung on the neck" in hooked_in_words(("upper",))
    assert "the upper and lower lip" in hooked_in_words(("upper", "lower"))
