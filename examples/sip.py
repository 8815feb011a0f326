"""A filmed sip, from its video to a page: convert, derive a scenario, solve, question, report.

    python sip.py

The film is one of the library's, and `end_s` ends it when both lips are pressed; with your own,
give its path and that of its marker file. Pictures and the page are written to the folder in which
the script is started.
"""

import matplotlib as mpl

import drinksim as ds

mpl.use("agg")  # pictures go to files

library = ds.load_scenario("A38-F")
motion = ds.convert(library.recording.video, markers=library.recording.markers, end_s=2.0)
print(motion)

scenario = library.with_(
    motion=motion, contact={"friction": 0.5}, numerics={"resolution": "coarse"}
)
solution = scenario.solve(progress=True)
print(solution)
print(solution.message)

for lip in ("upper", "lower"):
    pressure = solution[f"{lip}_lip_window_kpa"]
    print(f"{lip} lip, highest mean pressure over 0.5 mm: {pressure.values.max():.0f} kPa,")
    print(f"  and at 1.9 s: {pressure.at(1.9):.0f} kPa")

axes = solution["upper_lip_window_kpa"].plot()
solution["lower_lip_window_kpa"].plot(axes)
axes.legend()
axes.figure.savefig("pressure.png")
solution.at(1.9).plot("von_mises").figure.savefig("section.png")
print("pressure.png, section.png")
print(ds.report([solution], "page.html"))
