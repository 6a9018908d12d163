"""Which of its banks a plant is asked for."""

from svo.plant import BankChoice
from svo.plant.choice import what_differs


def test_banks_are_told_apart_by_what_differs() -> None:
    same = BankChoice("I", "lpv")
    assert what_differs([same, same]) == (BankChoice(),)
    assert what_differs([same, BankChoice("I", "nonlinear")]) == (
        BankChoice(None, "lpv"),
        BankChoice(None, "nonlinear"),
    )
    both = [BankChoice("I", "lpv"), BankChoice("II", "nonlinear")]
    assert what_differs(both) == tuple(both)
    assert what_differs([]) == ()


def test_a_choice_is_said_in_words() -> None:
    titles = {
        BankChoice(): "",
        BankChoice("II"): "Architecture II",
        BankChoice("I", "lpv"): "Architecture I, lpv models",
    }
    assert {choice: choice.title for choice in titles} == titles
