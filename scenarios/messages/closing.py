"""What a replay says at its end: what happened, what is felt, and what not to trust."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from scenarios.messages.lines import FELT_CONTRAST
from scenarios.messages.verdict import PAIN, Verdict
from scenarios.results.quantities import LIPS
from scenarios.results.solution import Solution


def closing_message(solution: Solution) -> str:
    """Return two sentences for whoever chooses between necks, and what else to mind.

    A replay that stopped states no peak: what presses most may come later.
    """
    sentences = _of_the_whole(solution) if solution.finished else _of_a_part(solution)
    notes = solution.summary.get("notes", ())
    return "\n".join([" ".join(sentences), *(f"note: {note}" for note in notes)])


def _of_a_part(solution: Solution) -> tuple[str, str]:
    return (
        f"The replay stopped at {solution.time_s[-1]:.2f} s, before the sip's end, where the "
        "solver found no equilibrium.",
        "No peak is stated, since what presses most may come later; do not compare it with whole "
        "sips (drinksim report and animate show it up to there, run.log says what the solver did).",
    )


def _of_the_whole(solution: Solution) -> tuple[str, str]:
    start, end = solution.time_s[[0, -1]]
    followed = f"The whole motion was followed, from {start:.2f} to {end:.2f} s"
    verdict = Verdict.of(solution.summary)
    if verdict.pressure_kpa <= 0.0:
        return (
            f"{followed}, and the neck never pressed a lip.",
            "Nothing is felt; look at drinksim preview, if the film shows a contact.",
        )
    lips = sorted(LIPS, key=lambda lip: lip != verdict.lip)
    first, second = (_pressed(solution, lip) for lip in lips)
    return f"{followed}: {first}, {second}.", _felt(solution.summary, verdict)


def _pressed(solution: Solution, lip: str) -> str:
    history = solution[f"{lip}_lip_window_kpa"]
    peak = int(history.values.argmax())
    if history.values[peak] <= 0.0:
        return f"the {lip} lip is not touched"
    return (
        f"the {lip} lip is pressed with up to {history.values[peak]:.0f} kPa over half a "
        f"millimetre (at {history.time_s[peak]:.2f} s)"
    )


def _felt(summary: Mapping[str, Any], verdict: Verdict) -> str:
    share = 100.0 * verdict.pressure_kpa / PAIN.low
    crests = [lip for lip in LIPS if summary[f"{lip}_lip_crest_contrast"] >= FELT_CONTRAST]
    tell = "lip tells" if len(crests) == 1 else "lip tell"
    felt = f"the {' and the '.join(crests)} {tell} crests apart" if crests else "no crest is felt"
    leaks = [lip for lip in LIPS if summary.get(f"{lip}_lip_seal_margin_kpa", 0.0) < 0.0]
    sealed = f", and the {' and the '.join(leaks)} lip does not seal" if leaks else ""
    return (
        f"That is {share:.0f} % of the lowest pressure that hurt volunteers, and {felt}{sealed}; "
        "compare it with other necks, but do not take it for a person's own pressure, since the "
        "model is one plane section of average lips."
    )
