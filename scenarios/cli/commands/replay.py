"""``drinksim replay``: a recorded sip on the model of the lips."""

from __future__ import annotations

from argparse import Namespace

from scenarios.cli.options import add_out, add_scenario, add_set, chosen_scenario
from scenarios.cli.parser import NOT_FINISHED, Parser, complain, warn
from scenarios.settings.scenario import Numerics
from scenarios.settings.tables import keys_of
from scenarios.settings.writing import about


def arguments(parser: Parser) -> None:
    """Add what the command takes."""
    add_scenario(parser)
    add_out(parser)
    for key in keys_of(Numerics, where="numerics"):
        if key.choices and key.path.count(".") == 1:
            parser.add_argument(
                f"--{key.field.name}",
                choices=key.choices,
                help=f"{about(key.field)} (default: the scenario's {key.path})",
            )
    left = parser.add_mutually_exclusive_group()
    left.add_argument(
        "--resume", action="store_true", help="go on with the unfinished run in --out, if any"
    )
    left.add_argument(
        "--overwrite", action="store_true", help="discard what an earlier run left in --out"
    )
    parser.add_argument(
        "--doubt",
        metavar="N",
        type=int,
        help="replay N motions sampled from the recording's standard errors too; a report shows "
        "them as bands",
    )
    parser.add_argument(
        "--workers",
        metavar="N",
        type=int,
        help="processes of one thread each for --doubt (default: all in this process)",
    )
    parser.add_argument(
        "--verbose", action="store_true", help="print also how the solver went, as run.log has it"
    )
    add_set(parser)


def run(options: Namespace) -> int:
    """Do it and return the exit code."""
    from scenarios.messages.closing import closing_message
    from scenarios.sip.run import NothingComputedError, solve

    if options.doubt is None and options.workers is not None:
        return complain("--workers has no effect without --doubt: leave it out")
    if options.doubt is not None and options.doubt < 1:
        return complain(f"--doubt {options.doubt}: give at least 1, or leave it out")
    scenario = chosen_scenario(options)
    try:
        solution = solve(
            scenario,
            out=options.out,
            resume=options.resume,
            overwrite=options.overwrite,
            warn=warn,
            progress=True,
        )
    except NothingComputedError as error:
        return complain(str(error), NOT_FINISHED)
    print(f"{options.out}: {closing_message(solution)}")
    if options.verbose:
        print(f"solver: {solution.message}")
    if options.doubt is not None:
        from scenarios.decision.doubt import doubt_message, doubt_study

        doubt_study(options.out, options.doubt, workers=options.workers, progress=True)
        print(doubt_message(options.out))
    stopped = f"{options.out} stopped at {solution.time_s[-1]:.2f} s: run.log there says why"
    return 0 if solution.finished else complain(stopped, NOT_FINISHED)
