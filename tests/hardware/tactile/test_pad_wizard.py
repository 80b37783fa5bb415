# SPDX-License-Identifier: MIT
import numpy as np
import pytest
from pad_hand import PADS, EmulatedPads, press, untouched

from hardware.tactile.pressure import PadCalibrationError, load_scale, save_scale
from hardware.tactile.wizard import PadWizard


class Person:
    """Does what the wizard asks, except where told otherwise; talks to emulated pads."""

    def __init__(self, pads, mistakes=()):
        self.pads = pads
        self.mistakes = list(mistakes)  # (part of the question, answer or forces)
        self.heard, self.forces = [], None

    def ask(self, question):
        pad = question.split(":")[0].split("] ")[-1]
        self.forces = press(pad) if pad in PADS else untouched(5.0)
        if self.mistakes and self.mistakes[0][0] in question:
            mistake = self.mistakes.pop(0)[1]
            if isinstance(mistake, str):
                return mistake
            self.forces = mistake
        return ""

    def sample(self, seconds):
        # Meanwhile creep and overshoot of the press before have gone.
        for _ in range(20):
            self.pads.signal.step(np.zeros(16), np.zeros(16), 0.5)
        return self.pads.resistances(self.forces[: round(seconds / 0.02)])

    def run(self):
        wizard = PadWizard(self.pads.wiring, self.sample, self.ask, self.heard.append)
        return wizard.run()


def test_a_careful_person_ends_with_the_drops_of_all_pads():
    person = Person(EmulatedPads(0))
    scale = person.run()
    pad = person.pads.parameters
    np.testing.assert_allclose(scale.drop[:12], (pad.drop * pad.rest_ohm)[:12], rtol=0.15)
    np.testing.assert_allclose(scale.baseline, person.pads.wiring.reference_ohm, rtol=0.02)


@pytest.mark.parametrize("insensitive", [12, 13])
def test_pads_in_parallel_take_the_scale_of_the_less_sensitive_one(insensitive):
    pads = EmulatedPads(1)
    pads.parameters.drop[[12, 13]] = 0.5
    pads.parameters.drop[insensitive] = 0.3
    scale = Person(pads).run()
    rest = pads.parameters.rest_ohm[[insensitive, 25 - insensitive]]
    fall = 1 / np.sum(1 / rest) - 1 / (1 / (0.7 * rest[0]) + 1 / rest[1])
    assert scale.drop[12] == pytest.approx(fall, rel=0.15)


def test_mistakes_are_told_and_may_be_repaired():
    touched = untouched(5.0)
    touched[50:, 3] = 2.0
    mistakes = [
        ("Take everything off", touched),
        (f"] {PADS[1]}:", press(PADS[7])),
        (f"] {PADS[2]}:", untouched(5.0)),
    ]
    person = Person(EmulatedPads(2), mistakes)
    scale = person.run()
    told = "\n".join(person.heard)
    assert f"{PADS[3]}: not steady" in told
    assert f"{PADS[7]} answered to the press, not {PADS[1]}" in told
    assert f"{PADS[2]} changed by" in told
    assert np.isfinite(scale.drop).all() and not person.mistakes


def test_a_skipped_pad_is_named_and_must_be_disabled_to_go_on(tmp_path):
    person = Person(EmulatedPads(3), [(f"] {PADS[4]}:", "s")])
    scale = person.run()
    assert np.flatnonzero(np.isnan(scale.drop)).tolist() == [4]
    assert f"list them under 'disabled' in the hand's file: {PADS[4]}" in person.heard[-1]
    save_scale(tmp_path / "pads.yaml", scale, person.pads.wiring)
    load_scale(tmp_path / "pads.yaml", EmulatedPads(3, disabled=frozenset({PADS[4]})).wiring)


def test_disabled_pads_are_not_asked_for():
    asked = []
    person = Person(EmulatedPads(4, disabled=frozenset({PADS[0], "pad_palm_inner_2"})))
    ask, person.ask = person.ask, lambda question: asked.append(question) or ask(question)
    person.run()
    text = "\n".join(asked)
    assert PADS[0] not in text and "pad_palm_inner_2" not in text
    assert "[14/14]" in text


def test_giving_up_saves_nothing():
    with pytest.raises(PadCalibrationError, match="given up, nothing is saved"):
        Person(EmulatedPads(5), [(f"] {PADS[6]}:", "q")]).run()
